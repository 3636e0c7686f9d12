"""`firmware-runtime new robot|chip NAME` and `new key FILE`: what one begins with."""

import argparse
import shlex
import shutil
import sys
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.errors import Status
from firmware_runtime.host.scaffold.chip import write_chip
from firmware_runtime.host.scaffold.package import write_robot
from firmware_runtime.links.key_file import KEY_BYTES, write_key

_ROBOT = """
The robot is a head on two servos that follows a light, a copy of the example `pan_tilt`: a package
that is complete and small, to be changed. Its tests run on doubles.
"""
_KEY = """
Two ends on a network know each other's datagrams by it, of a link or of a bridge. Both need the
same key: copy the file over a channel that is secret, such as `scp -p FILE robot:`. Its mode stays
0600, or it is refused.
"""
_CHIP = """
The package has a driver and a double made from the table, and the contract of chips as its test.
Without a table it begins with an example, to be edited.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Write what one begins with: a robot's package, a chip's, or a key for a link."
    verb = verbs.add_parser("new", help=summary, description=summary)
    kinds = verb.add_subparsers(required=True, metavar="WHAT")
    _add_robot_to(kinds)
    _add_chip_to(kinds)
    key = add_verb(kinds, "key", "Write a new key for both ends of a link, or a bridge.", _key)
    key.epilog = _KEY
    key.add_argument("file", type=Path, metavar="FILE", help="where; it must not exist yet")


def _add_robot_to(kinds: SubParsers) -> None:
    verb = add_verb(kinds, "robot", "Write a robot's package, with tests on doubles.", _robot)
    verb.epilog = _ROBOT
    add_place(verb, "what the package and its board are called: small letters, digits and _")


def _add_chip_to(kinds: SubParsers) -> None:
    verb = add_verb(kinds, "chip", "Write a chip's package from its register table.", _chip)
    verb.epilog = _CHIP
    add_place(verb, "what the package and the chip are called: small letters, digits and _")
    verb.add_argument(
        "--registers",
        type=Path,
        metavar="FILE.toml",
        help="its register table; default: an example",
    )


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


def _chip(arguments: argparse.Namespace) -> int:
    folder: Path = arguments.into or Path(arguments.name)
    show_written(folder, write_chip(arguments.name, folder, arguments.registers))
    return Status.OK


def _key(arguments: argparse.Namespace) -> int:
    write_key(arguments.file)
    print(f"{arguments.file}: a new key of {KEY_BYTES} random bytes, mode 0600")
    return Status.OK


def show_written(folder: Path, written: list[Path]) -> None:
    """Print the files of a new package, and the commands that come next."""
    for path in written:
        print(path)
    python, make = _interpreter()
    print("next:")
    if not folder.samefile("."):
        print(f"  cd {shlex.quote(str(folder))}")
    print(f"  {python} -m pip install --editable '.[test]'\n  {make}")


def _interpreter() -> tuple[str, str]:
    """How a shell calls this program's Python, and `make test` with it."""
    if Path(shutil.which("python") or "").parent == Path(sys.executable).parent:
        return "python", "make test"
    python = shlex.quote(sys.executable)
    return python, f"make test PYTHON={python}"
