"""The versions of a target and how its last update stands, as its own scripts tell it."""

from collections.abc import Iterable
from typing import NamedTuple

from msgspec import Struct

from firmware_runtime.errors import DeploymentError
from firmware_runtime.host.deployment.connection import Connection

SCRIPT = "/opt/firmware-runtime/update.sh"


class Version(NamedTuple):
    """A version of the program that a target has."""

    version: str
    folder: str
    """Its name below /opt/firmware-runtime."""
    since: str
    """When it was made there, UTC."""
    place: str
    """`in-use`, `before`, or `beside`."""

    def line(self) -> str:
        """Return it in words."""
        return f"{self.version:12} {self.folder}  {self.since}  {self.place.replace('-', ' ')}"

    def is_called(self, name: str) -> bool:
        """Return whether this is a name of it: its version, or its folder's."""
        return name in {self.version, self.folder, self.folder.removeprefix("venv.")}


def versions_of(lines: Iterable[str]) -> list[Version]:
    """Read versions as `list_versions` prints them."""
    words = (line.split() for line in lines)
    return [Version(*each) for each in words if len(each) == len(Version._fields)]


def version_called(name: str, versions: Iterable[Version], host: str) -> Version:
    """Return the one of that name. Raises DeploymentError, with those there are."""
    known = list(versions)
    found = [each for each in known if each.is_called(name)]
    if len(found) == 1:
        return found[0]
    there = ", ".join(f"{each.version} in {each.folder}" for each in known) or "none there"
    fault = f"{len(found)} versions are called {name!r}" if found else f"no version {name!r}"
    raise DeploymentError(fault, where=host, expected=f"one of {there}")


class Update(Struct, frozen=True):
    """The versions that a target has, and what became of the last update."""

    versions: tuple[Version, ...] = ()
    state: str = "none"
    """`staged`, `trying`, `committed`, `reverted`, `unproved`, or `none` before the first."""
    board: str = ""
    since: str = ""
    """When it came to that state, UTC."""
    reason: str = ""

    def lines(self) -> list[str]:
        """Return it in words, a line each."""
        named = {
            "last update": " ".join(filter(None, (self.state, self.since, self.board))),
            "because": self.reason,
        }
        return [
            *(each.line() for each in self.versions),
            *(f"{name:12} {each}" for name, each in named.items() if each),
        ]


def update_of(connection: Connection, wait_s: int = 0) -> Update:
    """Ask a target, which waits so long at most for the verdict on an update that is under way.

    Raises DeploymentError where it cannot be asked, or was never deployed to.
    """
    ended = connection.command("sh", SCRIPT, "status", str(wait_s))
    if ended.status != 0:
        raise DeploymentError(
            f"{SCRIPT}: {ended.reason}", where=connection.host, expected="a deployment before"
        )
    parted = (line.partition(" ") for line in ended.out.splitlines())
    pairs = [(key, value.strip()) for key, _, value in parted]
    answers = {key: value for key, value in pairs if key in _ANSWERS}
    versions = versions_of(value for key, value in pairs if key == "version")
    return Update(versions=tuple(versions), **answers)


_ANSWERS = {*Update.__struct_fields__} - {"versions"}
