"""A new robot: a package with its board, controller, world, rig, tests and README."""

from pathlib import Path

from firmware_runtime.board.installed import names
from firmware_runtime.errors import ConfigError
from firmware_runtime.host.scaffold.names import class_name, name_fault
from firmware_runtime.host.scaffold.package import write_package

TEMPLATE = "robot"


def write_robot(name: str, folder: Path) -> list[Path]:
    """Write a robot's package into a folder; return its files.

    Raises ConfigError for a name that a package or a board cannot have, and for a folder with
    something in it.
    """
    taken = f"{name!r}: a board of that name is installed; expected another name"
    fault = taken if name in names() else name_fault(name)
    if fault is not None:
        raise ConfigError.of_one("new robot", fault)
    return write_package(TEMPLATE, folder, {"robotname": name, "RobotName": class_name(name)})
