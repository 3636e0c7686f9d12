"""Arguments that several verbs share."""

import argparse
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

from firmware_runtime.devs.time import seconds
from firmware_runtime.errors import ConfigError
from firmware_runtime.statistics.paths import SUFFIX, find_statistics

SubParsers: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"
Options: TypeAlias = "argparse._ActionsContainer"
"""A verb, or a group of its options."""
Execute: TypeAlias = Callable[[argparse.Namespace], int]


_SPELLED: Mapping[str, str] = {
    "assignments": "--set",
    "begin": "--from",
    "board": "BOARD",
    "host": "HOST",
    "ports": "--port",
    "ssh_options": "-o",
    "when_late": "--when-late",
}
"""Options that are called otherwise in the command line."""

ADDRESS = re.compile(r".+:\d+")
"""Of a bridge, where a board may stand too."""


def refuse_idle(arguments: argparse.Namespace, where: str, names: Sequence[str], why: str) -> None:
    """Raise ConfigError for those of these options that are given: they have no effect, and why."""
    faults = [
        f"{_SPELLED.get(name, f'--{name}')}: has no effect{why}; expected it left out"
        for name in names
        if getattr(arguments, name)
    ]
    if faults:
        raise ConfigError(where, faults)


def add_verb(
    verbs: SubParsers, name: str, summary: str, execute: Execute
) -> argparse.ArgumentParser:
    """Add a verb whose one-line summary is also its description."""
    verb = verbs.add_parser(name, help=summary, description=summary)
    verb.set_defaults(execute=execute)
    return verb


def add_board(
    verb: argparse.ArgumentParser,
    *,
    required: bool = True,
    about: str = "a board's name, or the path of a board.toml or its folder",
    metavar: str = "BOARD",
) -> None:
    """Add BOARD and --set."""
    verb.add_argument("board", metavar=metavar, nargs=None if required else "?", help=about)
    add_set(verb, "override one number of board.toml, such as controller.kp=0.8")


def add_set(verb: argparse.ArgumentParser, about: str) -> None:
    """Add --set."""
    verb.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="assignments",
        help=f"{about}; may be repeated",
    )


def add_doubles(verb: argparse.ArgumentParser) -> None:
    """Add --doubles PATH, of doubles that are served."""
    verb.add_argument(
        "--doubles", type=Path, metavar="PATH", help="on the doubles that are served at PATH"
    )


def add_key(verb: argparse.ArgumentParser) -> None:
    """Add --key, of a bridge."""
    verb.add_argument("--key", type=Path, metavar="FILE", help="the bridge's key")


def add_output(verb: Options, about: str, *, metavar: str = "FILE", required: bool = False) -> None:
    """Add -o, of what is written."""
    verb.add_argument("-o", "--output", type=Path, required=required, metavar=metavar, help=about)


def add_statistics(verb: Options, about: str = "where the run keeps its statistics") -> None:
    """Add --statistics."""
    verb.add_argument("--statistics", type=Path, metavar="FILE", help=about)


def add_duration(verb: Options, about: str, dest: str = "duration_s") -> None:
    """Add --for, of seconds."""
    verb.add_argument("--for", type=positive, metavar="SECONDS", dest=dest, help=about)


def add_output_log(verb: argparse.ArgumentParser) -> None:
    """Add --log, which goes nowhere unless given."""
    verb.add_argument(
        "--log",
        type=Path,
        default=Path(os.devnull),
        metavar="FILE",
        help="write every change of an output, and when, as JSON lines, each at once",
    )


MOST = 1e9
"""Of any number of the command line: as many seconds fit into 64 bits of nanoseconds."""
MOST_SPEED = 1e6
"""Of a scaled clock: what is late by an hour of real time still fits."""


def speed(text: str) -> float:
    """How many times as fast a scaled clock goes."""
    return positive(text, MOST_SPEED)


def positive(text: str, most: float = MOST) -> float:
    """A positive number of the command line, within reason."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value <= most:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a positive number, {most:g} at most")
    return value


def second(text: str) -> int:
    """A second of a run on the command line, such as `9.06`, in ns."""
    value = since(text)
    return seconds(value) if value else 0


def since(text: str) -> float:
    """A second of a run on the command line, such as `9.06`."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 <= value <= MOST:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a second of the run, 0 or more")
    return value


def whole(text: str, least: int = 0, most: int | None = None) -> int:
    """A whole number of the command line within these ends."""
    number = int(text) if text.isascii() and text.isdigit() else -1
    if number < least or (most is not None and number > most):
        end = "on" if most is None else f"to {most}"
        expected = f"expected a whole number from {least} {end}"
        raise argparse.ArgumentTypeError(f"{text!r}: {expected}")
    return number


def port(text: str) -> int:
    """The number of a TCP port to listen on, 0 for any that is free."""
    return whole(text, most=65_535)


def instant(text: str) -> int:
    """An instant of the command line, `HH:MM:SS:mmm`, in ns."""
    from firmware_runtime.ecdpp.file_text import parse_time  # noqa: PLC0415 -- not for a run

    at = parse_time(text)
    if at is None:
        raise argparse.ArgumentTypeError(f"{text!r}: expected HH:MM:SS:mmm")
    return at


def add_kept(verb: argparse.ArgumentParser) -> None:
    """Add BOARD or FILE."""
    verb.add_argument(
        "kept",
        metavar="BOARD|FILE",
        nargs="?",
        help=f"a board's name, or a statistics file (FILE{SUFFIX}); default: whatever ran last",
    )


def add_recorded(verb: argparse.ArgumentParser) -> None:
    """Add RUN."""
    verb.add_argument(
        "run", metavar="RUN", help="a recording's file, or a board's name for its last run"
    )


def path_of(kept: str | None) -> Path:
    """The file that is meant. Raises StatisticsFileError when a board has left none."""
    if kept is not None and (os.sep in kept or kept.endswith(SUFFIX)):
        return Path(kept)
    return find_statistics(kept)
