"""The interpreter of a ROS environment: where it is, and how it starts with its libraries.

Two kinds of environment have rclpy:

- a venv with rclpy from wheels (`make ros`). One of them, ros-wheels-bootstrapper, installs a .pth
  file that starts every interpreter of the venv a second time, with the libraries on
  LD_LIBRARY_PATH, unless `_ROS_WHEELS_BOOTSTRAP_COMPLETE` is set. Here both are set at once.
- a venv with --system-site-packages where ROS is installed below /opt/ros; its `setup.sh` is
  sourced first, unless the environment already has it.
"""

import os
import re
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from firmware_runtime.errors import ConfigError
from firmware_runtime.system.programs import ProgramFailed, answer_of

PLACE = "FIRMWARE_RUNTIME_ROS_VENV"
"""Names the environment, where no option does."""
INSTALLED = Path("/opt/firmware-runtime/ros")
SETUP = "/opt/ros/jazzy/setup.sh"
"""What puts an installed ROS on the path."""
_NEEDED = ("rclpy", "firmware_runtime")
_MISSING = (
    "import sys; from importlib.util import find_spec as f; print(*(n for n in {} if not f(n)))"
)


def find_environment(stated: Path | None) -> Path:
    """The folder of the ROS environment. Raises ConfigError if there is none."""
    if stated is not None:
        return _checked("--venv", stated)
    if named := os.environ.get(PLACE):
        return _checked(PLACE, Path(named))
    beside = Path(__file__).parents[3] / ".venv-ros"
    for folder in (beside, INSTALLED):
        if python_of(folder).exists():
            return folder
    raise ConfigError.of_one(
        "ros2",
        f"no environment with rclpy at {beside} or {INSTALLED}",
        expected=f"one by `make ros`, or another that {PLACE} or --venv of `ros2` names: "
        "docs/ros2.md",
    )


def python_of(environment: Path) -> Path:
    """Its interpreter."""
    return environment / "bin" / "python3"


def command_of(environment: Path, arguments: Sequence[str]) -> list[str]:
    """The words that start its interpreter with these arguments."""
    words = [str(python_of(environment)), *arguments]
    is_sourced = "AMENT_PREFIX_PATH" in os.environ
    if _has_wheels(environment) or is_sourced or not Path(SETUP).exists():
        return words
    return ["/bin/sh", "-c", '. "$0" && exec "$@"', SETUP, *words]


def variables_of(environment: Path, inherited: Mapping[str, str]) -> dict[str, str]:
    """The variables of its process: those inherited, and where rclpy's libraries are."""
    if not _has_wheels(environment):
        return dict(inherited)
    libraries = [
        environment / "lib",
        *sorted(environment.glob("lib/python3*/site-packages/ros_*.libs")),
    ]
    path = [*map(str, libraries), inherited.get("LD_LIBRARY_PATH", "")]
    return {
        **inherited,
        "LD_LIBRARY_PATH": os.pathsep.join(filter(None, path)),
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1",
    }


def start(environment: Path, arguments: Sequence[str]) -> None:
    """Become its interpreter. Raises ConfigError if rclpy or this package is missing there."""
    missing = _missing(environment)
    if missing:
        lacks = f"has no {' and no '.join(missing)}"
        expected = "expected rclpy and firmware-runtime in it: docs/ros2.md"
        raise ConfigError.of_one(str(environment), f"{lacks}; {expected}")
    words = command_of(environment, arguments)
    os.execve(words[0], words, variables_of(environment, os.environ))  # noqa: S606 -- no shell


def _checked(source: str, folder: Path) -> Path:
    if python_of(folder).exists():
        return folder
    raise ConfigError.of_one(
        source, f"{folder}: no bin/python3 in it", expected="a venv with rclpy: docs/ros2.md"
    )


def _has_wheels(environment: Path) -> bool:
    return any(environment.glob("lib/python3*/site-packages/ros_wheels_bootstrapper.pth"))


def _missing(environment: Path) -> list[str]:
    words = command_of(environment, ["-c", _MISSING.format(_NEEDED)])
    variables = variables_of(environment, os.environ)
    try:
        return answer_of(words, environment=variables).split()
    except ProgramFailed as error:
        raise ConfigError.of_one(
            str(environment),
            f"its interpreter does not run ({error})",
            expected="a venv with rclpy",
        ) from error


DOMAIN: Final = "ROS_DOMAIN_ID"
HIGHEST_DOMAIN: Final = 232
"""Those above it have no ports."""
SHARED_MEMORY: Final = Path("/dev/shm")  # noqa: S108 -- where the C library has it
ROOM: Final = 1_000_000
"""Bytes that must be free there: a node's participant takes 0.7 MB."""


def check_surroundings(
    variables: Mapping[str, str], shared_memory: Path = SHARED_MEMORY, room: int = ROOM
) -> None:
    """Raise ConfigError for what a node cannot start with, all at once."""
    if faults := [*_of_domain(variables.get(DOMAIN, "")), *_of_memory(shared_memory, room)]:
        raise ConfigError("ros2", faults)


def _of_domain(stated: str) -> list[str]:
    is_number = re.fullmatch(r"0|[1-9][0-9]{0,2}", stated) is not None
    if stated == "" or (is_number and int(stated) <= HIGHEST_DOMAIN):
        return []
    return [f"{DOMAIN}: {stated!r}: expected a number from 0 to {HIGHEST_DOMAIN}"]


def _of_memory(shared_memory: Path, room: int) -> list[str]:
    with suppress(OSError):  # without it, nodes speak by the network alone
        found = os.statvfs(shared_memory)
        free = found.f_bavail * found.f_frsize
        if found.f_blocks > 0 and free < room:  # one without blocks has no limit
            return [f"{shared_memory}: {free // 1000} kB free, expected {room // 1000} or more"]
    return []


if __name__ == "__main__":
    start(Path(sys.argv[1]), sys.argv[2:])
