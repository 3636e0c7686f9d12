"""`firmware-runtime replay RUN [BOARD]`: run again what entered, and compare."""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from firmware_runtime.blackbox.found import find_recording
from firmware_runtime.board.registry import Board
from firmware_runtime.cli.arguments import (
    SubParsers,
    add_recorded,
    add_set,
    add_verb,
    second,
    speed,
)
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.devs.time import NEVER, format_time
from firmware_runtime.errors import ConfigError
from firmware_runtime.part_recording.comparison import Comparison
from firmware_runtime.part_recording.of_board import part_code, replay_of
from firmware_runtime.part_recording.recording import Recording, read_recording
from firmware_runtime.recording.chance import UNKEPT
from firmware_runtime.recording.changed_settings import (
    changed_board,
    changed_settings,
    settings_said,
)
from firmware_runtime.recording.code import changed_modules
from firmware_runtime.recording.file_kind import is_of_part
from firmware_runtime.recording.versions import changed_versions, versions_said
from firmware_runtime.status import Status

_EXPECTED = "expected the recording of a run: a board, or a name that `recordings` shows"
_ABOUT = """
Every run leaves a recording of what entered it: bytes of its buses and ports, external events, the
clock. RUN is the file of one, or a board's name for its last run, also of one that was killed. The
same drivers and models run again on it, as fast as they can; every value that leaves a port, every
transfer and the counts of activations are compared with the run's, floats to the bit. Of a file of
`run --record` that is the controller alone. Exit status 0: all are equal; 1: some differ, or the
recording is not whole; 12: none differs, but some could not be compared. With BOARD, --set or
--with it is a question, not a verdict: what other settings or code would have said to what entered,
every output's difference as numbers; status 0.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Run a recorded run again; compare everything that left its models."
    verb = add_verb(verbs, "replay", summary, execute)
    verb.epilog = _ABOUT
    add_recorded(verb)
    verb.add_argument(
        "board",
        metavar="BOARD",
        nargs="?",
        help="replay by this board's settings; default: those that the recording holds",
    )
    add_set(verb, "what if this number had been another")
    verb.add_argument(
        "--from",
        type=second,
        default=0,
        metavar="T",
        dest="begin",
        help="from the keyframe before this second of the run",
    )
    verb.add_argument(
        "--until", type=second, default=NEVER, metavar="T", help="to this second of the run"
    )
    verb.add_argument(
        "--speed",
        type=speed,
        metavar="N",
        help="so many times real time; default: as fast as it goes",
    )
    verb.add_argument("--json", action="store_true", help="print the comparison as JSON")
    _add_what_if(verb)


def _add_what_if(verb: argparse.ArgumentParser) -> None:
    """Add what asks for other code, and what is done with the answer."""
    verb.add_argument(
        "--with",
        type=Path,
        metavar="CHECKOUT",
        dest="checkout",
        help="what would the code in this folder have said? In a process of its own",
    )
    verb.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE.svg|.html",
        help="of what BOARD, --set or --with change: plots of the outputs that differ most",
    )
    verb.add_argument(
        "--watch",
        action="store_true",
        help="run it again whenever a file of the robot's packages, or of CHECKOUT, is saved",
    )
    verb.add_argument(
        "--as-test",
        type=Path,
        metavar="FILE.py",
        help="write a pytest test of the shortest piece that shows a difference, or of --from to "
        "--until, with its recording beside it",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Replay, and print what differs."""
    path = find_recording(arguments.run)
    if is_of_part(path):
        return _replay_part(arguments, path)
    return _replay_run(arguments, path)  # of what is none of both, its reading says so


def _replay_run(arguments: argparse.Namespace, path: Path) -> int:
    """Replay a whole run: what it was, or what it would have been."""
    if arguments.as_test is not None:
        from firmware_runtime.cli.as_test import as_test  # noqa: PLC0415 -- of runs only

        return as_test(arguments, path)
    is_changed = bool(arguments.checkout or arguments.assignments or arguments.board)
    if is_changed or arguments.watch:
        from firmware_runtime.cli.what_if import what_if_run  # noqa: PLC0415 -- of runs only

        return what_if_run(arguments, path)
    if arguments.output is not None:
        fault = f"-o {arguments.output}: nothing is changed; expected --set, --with or a board"
        raise ConfigError.of_one("replay", fault)
    from firmware_runtime.cli.replayed_run import replay_run  # noqa: PLC0415 -- of runs only

    return replay_run(arguments, path)


def _replay_part(arguments: argparse.Namespace, path: Path) -> int:
    """Replay a role's part, of a file of `run --record`."""
    stretch = {
        "--from": arguments.begin > 0,
        "--until": arguments.until < NEVER,
        "--with": arguments.checkout is not None,
        "-o": arguments.output is not None,
        "--watch": arguments.watch,
        "--as-test": arguments.as_test is not None,
    }
    if given := [name for name, is_given in stretch.items() if is_given]:
        fault = f"{given[0]}: a file of `run --record` is replayed as a whole"
        raise ConfigError.of_one("replay", f"{fault}; {_EXPECTED}")
    recording = read_recording(path)
    board = _board(arguments, recording)
    header = recording.header
    changes = changed_modules(header.code, part_code(board, header.components))
    comparison = replay_of(recording, board)
    settings = changed_settings(changed_board(header, ()), board)
    if arguments.json:
        said = _as_json(recording, comparison, changes)
        print(json.dumps({**said, "settings_changed": settings}, allow_nan=False))
    else:
        if arguments.board is not None or arguments.assignments:
            print(f"what if: {settings_said(settings)}")
        print("\n".join(_as_text(recording, comparison, changes)))
    return Status.OK if comparison.is_equal else Status.MODEL_ERROR


def _board(arguments: argparse.Namespace, recording: Recording) -> Board:
    if arguments.board is None:
        return changed_board(recording.header, arguments.assignments)
    return chosen_board(arguments.board, arguments.assignments)


def _as_json(recording: Recording, comparison: Comparison, changes: list[str]) -> dict[str, Any]:
    header = recording.header
    return {
        "board": header.board,
        "role": header.role,
        "identical": comparison.is_equal,
        "duration_s": recording.duration_s,
        **comparison.as_json(),
        "code_sha256": header.code_sha256,
        "code_changed": changes,
        "versions_changed": changed_versions(header.versions),
    }


def _as_text(recording: Recording, comparison: Comparison, changes: list[str]) -> Iterator[str]:
    header = recording.header
    if comparison.fault is not None:
        yield f"not compared as a whole: {comparison.fault}"
    if comparison.differences:
        yield from _difference(comparison)
        if comparison.has_drawn:
            yield f"  {UNKEPT}"
    elif comparison.fault is None:
        yield f"equal: {comparison.events} output events of the {header.role} of {header.board}"
    yield f"  {comparison.inputs} values entered, {comparison.events} left"
    if changes:
        yield f"  code that has changed since: {', '.join(changes)}"
    if versions := changed_versions(header.versions):
        yield f"  versions that are others than in the run: {versions_said(versions)}"


def _difference(comparison: Comparison) -> Iterator[str]:
    first, state = comparison.first, comparison.state
    if first is None:
        return
    yield f"{comparison.differences} of {comparison.events} output events differ; the first:"
    said = first.as_json(state)
    yield f"  at {format_time(first.at)}, port {first.port}"
    yield f"    recorded: {json.dumps(said['recorded'])}"
    yield f"    replayed: {json.dumps(said['replayed'])}"
    if state is None:
        yield "    no recorded field of its state differed"
        return
    field = said["state"]
    yield f"  first field of its state that differed: {state.field}, at {format_time(state.at)}"
    yield f"    recorded: {json.dumps(field['recorded'])}"
    yield f"    replayed: {json.dumps(field['replayed'])}"
