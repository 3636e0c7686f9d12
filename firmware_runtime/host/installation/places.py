"""Where everything lies on a robot, and what its units are called."""

from collections.abc import Iterator
from fnmatch import filter as matching

from firmware_runtime.board.local_settings import SETTINGS

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
USER = "firmware-runtime"


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
    """What starts a board with the machine: links, and what they lead to."""
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
