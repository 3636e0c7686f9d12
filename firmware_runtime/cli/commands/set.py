"""`firmware-runtime set BOARD [KEY | KEY=VALUE ...]`: gains and limits of a run under way."""

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from firmware_runtime.board.assignments import assigned
from firmware_runtime.board.registry import Board
from firmware_runtime.board.retuning import has_key
from firmware_runtime.board.setting_descriptions import Setting, described
from firmware_runtime.cli.arguments import SubParsers, add_statistics, add_verb
from firmware_runtime.cli.chosen_board import chosen_run
from firmware_runtime.errors import ConfigError, Status, expected_one_of
from firmware_runtime.links.control import ask
from firmware_runtime.statistics.paths import default_path

_ABOUT = """
Without words all of them are shown, with their ranges and meanings; of KEY alone that one. Of
KEY=VALUE all values are taken up, or none. They hold until the run ends or its file is read again
(SIGHUP, `systemctl reload`): the file itself stays as it is.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Show the gains and limits that a run is driven by, or change them."
    verb = add_verb(verbs, "set", summary, execute)
    verb.epilog = _ABOUT
    verb.add_argument("board", metavar="BOARD", help="a board's name, or the path of a board.toml")
    add_statistics(verb, "of the run that keeps this file")
    verb.add_argument(
        "words",
        metavar="KEY[=VALUE]",
        nargs="*",
        help="show these only, such as controller.kp, or change them: controller.kp=0.8",
    )
    verb.add_argument("--json", action="store_true", help="print the values as JSON")


def execute(arguments: argparse.Namespace) -> int:
    """Show or change them; ControlError says why the run gives no answer."""
    changes = [word for word in arguments.words if "=" in word]
    if not changes:
        return _show(arguments)
    if keys := [word for word in arguments.words if "=" not in word]:
        fault = f"{keys[0]}: no value, beside {changes[0]}"
        raise ConfigError.of_one("set", fault, expected="KEY=VALUE, or keys alone")
    if faults := [f"{word}: expected KEY=VALUE" for word in changes if word.startswith("=")]:
        raise ConfigError("set", faults)
    return _change(arguments, dict(map(assigned, changes)))


def _show(arguments: argparse.Namespace) -> int:
    """Print what the run answers."""
    board, run = chosen_run(arguments.board)
    values = ask(_statistics(arguments, run), "get")["values"]
    _refuse_unknown(arguments.words, values, board)
    wanted = {key: values[key] for key in arguments.words or values}
    if arguments.json:
        print(json.dumps(wanted, allow_nan=False))
    elif not values:
        print(f"{run}: no gain or limit that a run takes up; {_where(board)}")
    else:
        for line in _lines(wanted, described(board.settings, board.retunable)):
            print(line)
    return Status.OK


def _change(arguments: argparse.Namespace, values: Mapping[str, object]) -> int:
    """Have the run take up the values, and print them as they are then."""
    board, run = chosen_run(arguments.board)
    statistics = _statistics(arguments, run)
    known = ask(statistics, "get")["values"]
    fixed = {key for key in values if has_key(board.settings, key)}  # why not, says the run
    _refuse_unknown([key for key in values if key not in fixed], known, board)
    answer = ask(statistics, "set", values=values)
    for reason in answer["refused"]:
        print(f"firmware-runtime: set refused: {reason}", file=sys.stderr)
    if answer["refused"]:
        return Status.REFUSED
    taken = {key: answer["values"][key] for key in values}
    if arguments.json:
        print(json.dumps(taken, allow_nan=False))
        return Status.OK
    for key, value in taken.items():
        print(f"{key} = {json.dumps(value)}")
    return Status.OK


def _where(board: Board) -> str:
    """Where there may be some, if none was shown."""
    if board.retunable:
        return "those of this board are taken up by the other role's run"
    return "its board's definition names none as `retunable`"


def _statistics(arguments: argparse.Namespace, run: str) -> Path:
    found: Path = arguments.statistics or default_path(run)
    return found


def _refuse_unknown(keys: Sequence[str], known: Mapping[str, object], board: Board) -> None:
    expected = f"expected one of {', '.join(known) or 'none: it takes up no key'}"
    faults = [
        f"{key}: this run does not take it up; {expected}"
        if has_key(board.settings, key)
        else f"{key}: unknown key; {expected_one_of(key, known)}"
        for key in keys
        if key not in known
    ]
    if faults:
        raise ConfigError("set", faults)


def _lines(values: Mapping[str, object], settings: Mapping[str, Setting]) -> Iterator[str]:
    """Each value, its range and what it is, in columns."""
    stated = {key: f"{key} = {json.dumps(value)}" for key, value in values.items()}
    wide = max(map(len, stated.values()), default=0)
    ranges = {key: settings[key].range if key in settings else "" for key in stated}
    broad = max(map(len, ranges.values()), default=0)
    for key, text in stated.items():
        about = settings[key].text if key in settings else ""
        yield f"{text:{wide}}  {ranges[key]:{broad}}  {about}".rstrip()
