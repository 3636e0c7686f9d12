"""Several robots, deployed to one after the other, up to the first that fails.

A fleet is a TOML file with a table for each robot:

    [left]
    host = "pi@left"
    board = "left"
    settings = "left.toml"
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, TypeVar

from msgspec import Meta

from firmware_runtime.board import strict
from firmware_runtime.board.settings import Settings
from firmware_runtime.errors import ConfigError, FirmwareRuntimeError, Status, text_of
from firmware_runtime.system.atomic_file import read_text

R = TypeVar("R")
_ENDINGS = {
    Status.OK: "done",
    Status.NOTHING_HAPPENED: "deployed, but no activation was seen",
    Status.INTERRUPTED: "interrupted",
}


class FleetRobot(Settings, frozen=True):
    """A robot of a fleet; what is not given is as for `deploy`."""

    host: str
    board: str
    settings: str | None = None
    """A board.toml, from the fleet's folder."""
    port: Annotated[int, Meta(ge=1, le=65535)] | None = None
    identity: str | None = None
    """A private key, from the fleet's folder."""
    ssh_options: tuple[str, ...] = ()
    python: str | None = None


def load_fleet(file: Path) -> dict[str, FleetRobot]:
    """Read a fleet. Raises ConfigError with every fault found."""
    faults: list[str] = []
    table = strict.parse_toml(read_text(file), faults)
    robots: dict[str, FleetRobot] = {}
    for name, each in table.items():
        if not isinstance(each, dict):
            faults.append(f"{name}: {strict.shown(each)}: expected a table, a robot's")
        elif (robot := strict.convert(each, FleetRobot, faults, name)) is not None:
            robots[name] = robot
    if not table and not faults:
        faults.append("no robot; expected a table for each")
    if faults:
        raise ConfigError(str(file), faults)
    return robots


def deploy_all(
    robots: Mapping[str, R], deploy: Callable[[R], int], log: Callable[[str], None]
) -> int:
    """Deploy to each, up to the first that fails; print what became of all; return its status.

    Raises what `deploy` raises, after that.
    """
    outcomes = dict.fromkeys(robots, "not done")
    status: int = Status.OK
    try:
        for name, robot in robots.items():
            log(f"\n{name}")
            outcomes[name] = "failed"
            status = deploy(robot)
            outcomes[name] = _ENDINGS.get(Status(status), outcomes[name])
            if status != Status.OK:
                break
    except FirmwareRuntimeError as error:
        outcomes[name] = " ".join(f"failed: {text_of(error)}".split())
        raise
    finally:
        width = max(map(len, outcomes))
        log("")
        for name, outcome in outcomes.items():
            log(f"{name:{width}}  {outcome}")
    return status
