"""Answers a shell that completes this command, by argcomplete.

The script that `register-python-argcomplete firmware-runtime` prints starts the program that is
installed at each Tab, with the line so far in its environment, so verbs, options and boards are
that program's own. Where it knows nothing, files are offered.
"""

import argparse
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import TextIO

import argcomplete
from argcomplete.completers import BaseCompleter, FilesCompleter
from argcomplete.lexers import split_line

from firmware_runtime.board.experiments import ALL
from firmware_runtime.board.local_settings import known_names
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.cli.main import parser
from firmware_runtime.cli.verbs import verb_names
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.listing import name_of
from firmware_runtime.recording.blackbox.locations import kept_recordings, last_recordings
from firmware_runtime.system.packages import installed

CHIP_DOUBLES = "firmware_runtime.chip_doubles"
"""Entry points of what `--chip` names."""


def complete(output: TextIO | None = None, leave: Callable[[int], object] = os._exit) -> None:
    """Write how the line in the environment may go on to the script, and end the process."""
    line, point = os.environ["COMP_LINE"], int(os.environ["COMP_POINT"])
    _, current, _, (_, *before), _ = split_line(line, point)
    argcomplete.autocomplete(
        _command_line(before, current),
        always_complete_options=False,
        default_completer=_Values(),
        output_stream=output,
        exit_method=leave,
    )


def _command_line(before: Sequence[str], current: str) -> argparse.ArgumentParser:
    """The command line with the verb that was typed; where that is to come, with all names."""
    verbs = verb_names()
    if before and before[0] in verbs:
        return parser(before)
    if current.startswith("-"):
        return parser(["--"])
    top = argparse.ArgumentParser(add_help=False)
    if not before:
        top.add_argument("verb", choices=verbs)
    return top


class _Values(BaseCompleter):
    """Values of arguments that have no choices of their own, as far as they are known."""

    def __call__(
        self,
        *,
        prefix: str,
        action: argparse.Action,
        parser: argparse.ArgumentParser,
        parsed_args: argparse.Namespace,
    ) -> list[str]:
        """Return what may stand in the place of this argument; files where that is not known."""
        if prefix.startswith("-"):  # of a verb that takes the rest of the line as it is
            return list(parser._option_string_actions)  # noqa: SLF001 -- there is no public list
        known = _known(action, parser.prog.rpartition(" ")[2], getattr(parsed_args, "board", None))
        if known is not None:
            return list(known)
        is_bash = os.environ.get("_ARGCOMPLETE_SHELL") == "bash"  # which offers them by itself
        return [] if is_bash else FilesCompleter()(prefix)


def _known(action: argparse.Action, verb: str, board: str | None) -> Iterable[str] | None:
    """Return the values of a verb's argument, None where any may be."""
    if not action.option_strings and action.dest == "run":
        return _recordings(known_names())
    if action.dest in {"board", "compared"}:
        return [*known_names(), *_beside_boards(verb)]
    if action.dest == "experiment":
        return _experiments()
    if action.dest == "chips":
        return sorted(each.name for each in installed(CHIP_DOUBLES))
    if action.dest in {"assignments", "vary"}:
        return _keys(board)
    return None


def _beside_boards(verb: str) -> Iterable[str]:
    """What may stand where a board may, for this verb."""
    if verb == "export":
        return _recordings(())
    return ("show", "rerun") if verb == "sweep" else ()


def _keys(board: str | None) -> Iterable[str]:
    """The keys of the board that was named."""
    if board is None:
        return ()
    try:
        return [f"{key}=" for key in _leaves(chosen_board(board).table)]
    except ConfigError:
        return ()


def _experiments() -> list[str]:
    """The experiments of every kind of board that can be read, and the word for all."""
    from firmware_runtime.lab.experiments.known import experiments_of  # noqa: PLC0415 -- for this alone

    found = {ALL}
    for name in known_names():
        with suppress(ConfigError):
            found.update(experiments_of(chosen_board(name)))
    return sorted(found)


def _recordings(boards: Iterable[str]) -> Iterable[str]:
    """Boards, each for its last run, and the names of recordings; none of them is opened."""
    with suppress(OSError):
        boards = [*boards, *map(name_of, [*last_recordings(), *kept_recordings()])]
    return dict.fromkeys(boards)


def _leaves(table: Mapping[str, object], prefix: str = "") -> Iterator[str]:
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield prefix + key
