"""`firmware-runtime get BOARD`, `set BOARD KEY=VALUE`: gains and limits of a run under way."""

import argparse
import json
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from firmware_runtime.board.assignments import assigned
from firmware_runtime.board.registry import Board
from firmware_runtime.board.retuning import has_key
from firmware_runtime.board.setting_descriptions import Setting, described
from firmware_runtime.cli.arguments import SubParsers, add_statistics, add_verb
from firmware_runtime.cli.chosen_board import chosen_run
from firmware_runtime.errors import ConfigError, Status, did_you_mean
from firmware_runtime.links.control import ask
from firmware_runtime.statistics.paths import default_path

_ABOUT = """
All of the values are taken up, or none. They hold until the run ends or its file is read again
(SIGHUP, `systemctl reload`): the file itself stays as it is.
"""


def add_to(verbs: SubParsers) -> None:
    """Add both verbs to the command line."""
    verb = add_verb(verbs, "get", "Show the gains and limits that a run is driven by.", _get)
    _add_run(verb)
    verb.add_argument("keys", metavar="KEY", nargs="*", help="only these, such as controller.kp")
    verb.add_argument("--json", action="store_true", help="print their values as JSON")
    verb = add_verb(verbs, "set", "Change gains and limits of a run under way.", _set)
    verb.epilog = _ABOUT
    _add_run(verb)
    verb.add_argument("values", metavar="KEY=VALUE", nargs="+", help="such as controller.kp=0.8")


def _add_run(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("board", metavar="BOARD", help="a board's name, or the path of a board.toml")
    add_statistics(verb, "of the run that keeps this file")


def _get(arguments: argparse.Namespace) -> int:
    """Print what the run answers; ControlError says why there is no answer."""
    board, run = chosen_run(arguments.board)
    values = ask(_statistics(arguments, run), "get")["values"]
    _refuse_unknown("get", arguments.keys, values, board)
    wanted = {key: values[key] for key in arguments.keys or values}
    if arguments.json:
        print(json.dumps(wanted, allow_nan=False))
    elif not values:
        print(f"{run}: no gain or limit that a run takes up; {_where(board)}")
    else:
        for line in _lines(wanted, described(board.settings, board.retunable)):
            print(line)
    return Status.OK


def _set(arguments: argparse.Namespace) -> int:
    """Have the run take up the values, and print them as they are then."""
    board, run = chosen_run(arguments.board)
    values, statistics = dict(_assignments(arguments.values)), _statistics(arguments, run)
    known = ask(statistics, "get")["values"]
    fixed = {key for key in values if has_key(board.settings, key)}  # why not, says the run
    _refuse_unknown("set", [key for key in values if key not in fixed], known, board)
    answer = ask(statistics, "set", values=values)
    for reason in answer["refused"]:
        print(f"firmware-runtime: set refused: {reason}", file=sys.stderr)
    if answer["refused"]:
        return Status.REFUSED
    for key in values:
        print(f"{key} = {json.dumps(answer['values'][key])}")
    return Status.OK


def _where(board: Board) -> str:
    """Where there may be some, if none was shown."""
    if board.retunable:
        return "those of this board are taken up by the other role's run"
    return "its board's definition names none as `retunable`"


def _statistics(arguments: argparse.Namespace, run: str) -> Path:
    found: Path = arguments.statistics or default_path(run)
    return found


def _refuse_unknown(
    verb: str, keys: Sequence[str], known: Mapping[str, object], board: Board
) -> None:
    expected = f"expected one of {', '.join(known) or 'none: it takes up no key'}"
    faults = [
        f"{key}: this run does not take it up; {expected}"
        if has_key(board.settings, key)
        else f"{key}: unknown key; {expected}{did_you_mean(key, known)}"
        for key in keys
        if key not in known
    ]
    if faults:
        raise ConfigError(verb, faults)


def _lines(values: Mapping[str, object], settings: Mapping[str, Setting]) -> Iterator[str]:
    """Each value, its range and what it is, in columns."""
    stated = {key: f"{key} = {json.dumps(value)}" for key, value in values.items()}
    wide = max(map(len, stated.values()), default=0)
    ranges = {key: settings[key].range if key in settings else "" for key in stated}
    broad = max(map(len, ranges.values()), default=0)
    for key, text in stated.items():
        about = settings[key].text if key in settings else ""
        yield f"{text:{wide}}  {ranges[key]:{broad}}  {about}".rstrip()


def _assignments(texts: Iterable[str]) -> Iterator[tuple[str, object]]:
    """Keys and values; these are TOML, or else texts. Raises ConfigError."""
    faults: list[str] = []
    for text in texts:
        key, separator, _ = text.partition("=")
        if key.strip() and separator:
            yield assigned(text)
        else:
            faults.append(f"{text}: expected KEY=VALUE, such as controller.kp=0.8")
    if faults:
        raise ConfigError("set", faults)
