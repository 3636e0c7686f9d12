"""`ros2 run firmware_runtime_ros2 robot BOARD [OPTIONS] [--ros-args ...]`.

Becomes `firmware-runtime ros2 BOARD`, with the environment that this interpreter is in unless
`--venv` names another. The program is the one that $FIRMWARE_RUNTIME_PROGRAM names, or else the one
on the path.
"""

import os
import shutil
import sys
from collections.abc import Sequence

PROGRAM = "FIRMWARE_RUNTIME_PROGRAM"


def command(program: str, words: Sequence[str]) -> list[str]:
    """The command that starts the node."""
    own = [] if "--venv" in words or "FIRMWARE_RUNTIME_ROS_VENV" in os.environ else _own()
    return [program, "ros2", *words[:1], *own, *words[1:]]


def main() -> None:
    """Become the node."""
    program = os.environ.get(PROGRAM) or shutil.which("firmware-runtime")
    if program is None:
        sys.exit(f"firmware-runtime: not found; expected it on the path, or its path in ${PROGRAM}")
    words = command(program, sys.argv[1:])
    os.execv(words[0], words)  # noqa: S606 -- no shell


def _own() -> list[str]:
    return ["--venv", sys.prefix]


if __name__ == "__main__":
    main()
