"""How the last update of a target stands, as its own scripts tell it."""

from msgspec import Struct

from firmware_runtime.errors import DeploymentError
from firmware_runtime.host.deployment.connection import Connection

SCRIPT = "/opt/firmware-runtime/update.sh"


class Update(Struct, frozen=True):
    """The versions that a target has, and what became of the last update."""

    venv: str = ""
    """Version and folder of the program in use."""
    previous: str = ""
    """Those of the one before."""
    state: str = "none"
    """`staged`, `trying`, `committed`, `reverted`, `unproved`, or `none` before the first."""
    board: str = ""
    since: str = ""
    """When it came to that state, UTC."""
    reason: str = ""

    def lines(self) -> list[str]:
        """Return it in words, a line each."""
        named = {
            "in use": self.venv or "none",
            "before": self.previous or "none",
            "last update": " ".join(filter(None, (self.state, self.since, self.board))),
            "because": self.reason,
        }
        return [f"{name:12} {each}" for name, each in named.items() if each]


def update_of(connection: Connection) -> Update:
    """Ask a target. Raises DeploymentError where it cannot be asked, or was never deployed to."""
    ended = connection.command("sh", SCRIPT, "status")
    if ended.status != 0:
        raise DeploymentError(
            f"{SCRIPT}: {ended.reason}", where=connection.host, expected="a deployment before"
        )
    answers: dict[str, str] = {}
    for line in ended.out.splitlines():
        key, _, value = line.partition(" ")
        if key in Update.__struct_fields__:
            answers[key] = value.strip()
    return Update(**answers)
