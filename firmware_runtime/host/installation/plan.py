"""The files that make a board a service: a function of board, program and version, nothing else.

Where units and rules come from: the folder `units` of this package, which is `systemd` at the top
of the repository.
"""

from dataclasses import dataclass
from importlib.resources import files

from firmware_runtime.board.registry import Board
from firmware_runtime.host.installation.drop_in import drop_in
from firmware_runtime.host.installation.places import (
    DEVICE_RULES,
    PROGRAM,
    SERVICES,
    SYSTEM_USERS,
    TEMPORARY_FILES,
    WITH_DEVICES,
    drop_in_path,
    settings_path,
    unit_path,
)

_SHARED = {
    SYSTEM_USERS: "sysusers.conf",
    TEMPORARY_FILES: "tmpfiles.conf",
    DEVICE_RULES: "udev.rules",
}


@dataclass(frozen=True, slots=True)
class File:
    """A file of an installation, by its path on the robot."""

    path: str
    content: str
    mode: int = 0o644
    is_users: bool = False
    """It is written once; from then on it is the user's."""


def files_of(board: Board, shipped: str, program: str, version: str) -> tuple[File, ...]:
    """All files of a board's installation.

    `board` is as the user's copy of its settings has it, `shipped` the text of a copy that is not
    there yet. Raises InstallationRefused for a device node that cannot stand in a unit.
    """
    return (
        File(settings_path(board.name), shipped, is_users=True),
        *shared_files(program),
        *(
            File(drop_in_path(service, board.name), drop_in(service, board, version))
            for service in WITH_DEVICES
        ),
    )


def shared_files(program: str = PROGRAM) -> tuple[File, ...]:
    """Those that all boards share; their units start this program."""
    units = (File(unit_path(each), unit(each, program)) for each in SERVICES)
    others = (File(path, _shipped(name)) for path, name in _SHARED.items())
    return (*units, *others)


def unit(service: str, program: str) -> str:
    """A template unit that starts this program."""
    return _shipped(f"{service}@.service").replace(PROGRAM, program.replace("%", "%%"))


def _shipped(name: str) -> str:
    return (files("firmware_runtime.host.installation") / "units" / name).read_text(
        encoding="utf-8"
    )
