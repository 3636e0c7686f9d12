"""`firmware-runtime new robot NAME`: a package of one's own to begin with."""

import argparse
import shlex
import shutil
import sys
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.scaffold.robot import write_robot
from firmware_runtime.status import Status

_ROBOT = """
The robot has one motor and one sonar and keeps its distance from a wall: a package that is complete
and small, to be changed. Its tests run on doubles.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Write a package of your own: a robot to begin with."
    verb = verbs.add_parser("new", help=summary, description=summary)
    kinds = verb.add_subparsers(required=True, metavar="WHAT")
    _add_robot_to(kinds)


def _add_robot_to(kinds: SubParsers) -> None:
    verb = add_verb(kinds, "robot", "Write a robot's package, with tests on doubles.", _robot)
    verb.epilog = _ROBOT
    add_place(verb, "what the package and its board are called: small letters, digits and _")


def add_place(verb: argparse.ArgumentParser, about: str) -> None:
    """Add NAME and --into DIR."""
    verb.add_argument("name", metavar="NAME", help=about)
    verb.add_argument(
        "--into", type=Path, metavar="DIR", help="a new or empty folder; default: ./NAME"
    )


def _robot(arguments: argparse.Namespace) -> int:
    folder: Path = arguments.into or Path(arguments.name)
    show_written(folder, write_robot(arguments.name, folder))
    return Status.OK


def show_written(folder: Path, written: list[Path]) -> None:
    """Print the files of a new package, and the three commands that come next."""
    for path in written:
        print(path)
    python, make = _interpreter()
    print(f"next:\n  cd {shlex.quote(str(folder))}")
    print(f"  {python} -m pip install --editable '.[test]'\n  {make}")


def _interpreter() -> tuple[str, str]:
    """How a shell calls this program's Python, and `make test` with it."""
    if Path(shutil.which("python") or "").parent == Path(sys.executable).parent:
        return "python", "make test"
    python = shlex.quote(sys.executable)
    return python, f"make test PYTHON={python}"
