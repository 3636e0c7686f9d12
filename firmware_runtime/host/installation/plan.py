"""Files that make a board a service: where they lie on a robot, and what is in them.

A function of board, program and version, nothing else. Units and rules come from the folder `units`
of this package, which is `systemd` at the top of the repository. What a board's units need beyond
the templates is in drop-ins: device nodes, whatever in its settings is a text that begins with
`/dev/`, priority, and the watchdog's time.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from fnmatch import filter as matching
from importlib.resources import files

import msgspec

from firmware_runtime.board.local_settings import SETTINGS
from firmware_runtime.board.registry import Board
from firmware_runtime.board.settings import ExecutiveSettings
from firmware_runtime.errors import InstallationRefused

RUNTIME, GUARD = "firmware-runtime", "firmware-runtime-guard"
METRICS, RECORDER = "firmware-runtime-metrics", "firmware-runtime-record"
BRIDGE, ROS2 = "firmware-runtime-bridge", "firmware-runtime-ros2"
SERVICES = (RUNTIME, GUARD, METRICS, RECORDER, BRIDGE, ROS2)
WITH_DEVICES = (RUNTIME, GUARD, ROS2)
"""Those that open the device nodes of their board."""

UNITS = "/etc/systemd/system"
WANTED = f"{UNITS}/multi-user.target.wants"
SYSTEM_USERS = "/etc/sysusers.d/firmware-runtime.conf"
TEMPORARY_FILES = "/etc/tmpfiles.d/firmware-runtime.conf"
DEVICE_RULES = "/etc/udev/rules.d/60-firmware-runtime.rules"
RUNTIME_DIRECTORY = "/run/firmware-runtime"
RECORDS = "/var/lib/firmware-runtime"
"""Where the recorder keeps what runs left, a folder a board."""
PROGRAM = "/opt/firmware-runtime/venv/bin/firmware-runtime"
"""What the units start, unless the program was installed elsewhere."""


def unit_path(service: str) -> str:
    """The file of a service's template unit."""
    return f"{UNITS}/{service}@.service"


def instance(service: str, board: str) -> str:
    """The unit that serves one board."""
    return f"{service}@{board}.service"


def drop_in_path(service: str, board: str) -> str:
    """The file with what one board needs beyond the template."""
    return f"{UNITS}/{instance(service, board)}.d/board.conf"


def settings_path(board: str) -> str:
    """The user's copy of a board's settings."""
    return f"{SETTINGS}/{board}.toml"


def links(board: str) -> dict[str, str]:
    """Return what starts a board with the machine: links, and what they lead to."""
    return {
        f"{WANTED}/{instance(service, board)}": unit_path(service) for service in (GUARD, RUNTIME)
    }


def boards_among(names: list[str]) -> Iterator[str]:
    """The boards that drop-ins of these names in UNITS belong to."""
    before, after = f"{RUNTIME}@", ".service.d"
    for name in matching(names, f"{before}*{after}"):
        yield name.removeprefix(before).removesuffix(after)


def boards_with_settings(names: list[str]) -> Iterator[str]:
    """The boards that files of these names in SETTINGS belong to."""
    for name in matching(names, "*.toml"):
        yield name.removesuffix(".toml")


_DEVICES = "/dev/"
_PLAIN = re.compile(r"/dev/[A-Za-z0-9_.,:+/-]+")
"""What can stand in a unit as it is."""
_HIGHEST = 99
_CPU_LATENCY = "/dev/cpu_dma_latency"


def drop_in(service: str, board: Board, version: str) -> str:
    """The drop-in of a service that opens devices. Raises InstallationRefused."""
    lines = [
        f"# Written by firmware-runtime {version} from {settings_path(board.name)}, and again by",
        f"# every `firmware-runtime service install {board.name}`. Device nodes, priority and",
        "# the watchdog's time belong into that file; other changes: systemctl edit.",
        "[Service]",
        *([] if service == ROS2 else _scheduling(service, board.settings.executive.fifo_priority)),
        *(f"DeviceAllow={node} rw" for node in device_nodes(board)),
    ]
    if service == RUNTIME:
        lines += _of_the_run(board.settings.executive)
    return "\n".join(lines) + "\n"


def device_nodes(board: Board) -> list[str]:
    """The device nodes that a board's settings name, each once, in order."""
    nodes = dict.fromkeys(_texts_below(msgspec.to_builtins(board.settings)))
    for node in nodes:
        if _PLAIN.fullmatch(node) is None or ".." in node:
            raise InstallationRefused(
                f"{node!r} cannot stand in a unit",
                where=board.source,
                expected="a device node such as /dev/i2c-1",
            )
    return list(nodes)


def _scheduling(service: str, priority: int) -> Iterator[str]:
    """The guard has its priority from its start; the run, one lower, sets its own once it is up."""
    own = min(priority + 1, _HIGHEST) if service == GUARD and priority > 0 else priority
    yield f"LimitRTPRIO={own}"
    if service == GUARD:
        yield f"CPUSchedulingPriority={own}" if own > 0 else "CPUSchedulingPolicy=other"


def _of_the_run(executive: ExecutiveSettings) -> Iterator[str]:
    yield f"TimeoutStartSec={executive.bring_up_s:g}s"
    yield f"WatchdogSec={executive.watchdog_s:g}s"
    if executive.keep_cpu_awake:
        yield f"DeviceAllow={_CPU_LATENCY} w"


def _texts_below(value: object) -> Iterator[str]:
    """Every text in a tree of tables and lists that names a device."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list | tuple):
        for each in value:
            yield from _texts_below(each)
    elif isinstance(value, str) and value.startswith(_DEVICES):
        yield value


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
