"""`replay RUN --as-test FILE`: a piece of the run becomes a test, with its recording beside it."""

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import wrap
from typing import Any

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.board_of_recording import changed_board
from firmware_runtime.recording.replay.replay_assertion import difference_of, in_words
from firmware_runtime.recording.replay.verdict import Stretch, replay
from firmware_runtime.recording.what_if.checkout import ask, checked_folder
from firmware_runtime.recording.what_if.piece import Cutter, Piece, Shows
from firmware_runtime.recording.what_if.what_if import Question, answer
from firmware_runtime.system.atomic_file import keep_output

_WIDTH = 88
_TEST = '''\
"""{about}

{written}
"""

from pathlib import Path

from firmware_runtime.recording.replay.replay_assertion import assert_replays

RECORDING = Path(__file__).with_suffix(".recording")


def {name}() -> None:
    assert_replays(RECORDING{settings})
'''


def as_test(arguments: argparse.Namespace, path: Path) -> int:
    """Cut the piece, and write both files."""
    test: Path = arguments.as_test
    _check(arguments, test)
    recording = read_recording(path)
    board = changed_board(recording.header, ())
    stretch = Stretch(arguments.begin, arguments.until)
    verdict = replay(recording, board, stretch)
    is_changed = bool(arguments.checkout or arguments.assignments)
    if verdict.first is not None:
        cutter = Cutter(recording, board, _shown_here)
        piece = cutter.around(verdict.first.at, is_true=False)
    elif is_changed:
        piece = _changed_piece(arguments, path, Cutter(recording, board, _shows(arguments)))
    else:
        piece = Cutter(recording, board, _shown_here).stretch(stretch)
    _write(arguments, test, piece, recording.header.run, verdict.faults)
    return Status.OK


def _check(arguments: argparse.Namespace, test: Path) -> None:
    """Refuse what cannot be a test, and what would be written over."""
    where = f"--as-test {test}"
    if test.suffix != ".py" or not test.stem.isidentifier():
        raise ConfigError.of_one(where, "expected the name of a module, such as test_that_day.py")
    for each in (test, test.with_suffix(".recording")):
        if each.exists():
            raise ConfigError.of_one(where, f"{each} is there already", expected="another name")
    if not test.absolute().parent.is_dir():
        raise ConfigError.of_one(where, f"expected a folder {test.parent}")
    given = {"BOARD": arguments.board, "--speed": arguments.speed, "-o": arguments.output}
    for name, value in given.items():
        if value is not None:
            raise ConfigError.of_one("replay", f"--as-test with {name}", expected="one of them")


def _changed_piece(arguments: argparse.Namespace, path: Path, cutter: Cutter) -> Piece:
    """The piece that shows what other settings or code change."""
    first = _difference(arguments, path, arguments.begin, arguments.until)
    if first is None:
        fault = "no output would have been another; expected a difference, or nothing that changes"
        raise ConfigError.of_one("--as-test", fault)
    return cutter.around(first["t_ns"], is_true=True)


def _difference(
    arguments: argparse.Namespace, path: Path, begin: int, until: int
) -> Mapping[str, Any] | None:
    """The first difference that the settings or the code of the command line make."""
    question = Question(
        recording=str(path.absolute()), assignments=arguments.assignments, begin=begin, until=until
    )
    if arguments.checkout is None:
        return answer(question).first_difference
    return ask(question, checked_folder(arguments.checkout)).first_difference


def _shows(arguments: argparse.Namespace) -> Shows:
    """What a file shows to the settings or the code of the command line."""
    return partial(_in_file, lambda path: _difference(arguments, path, 0, NEVER))


def _shown_here(content: bytes) -> Mapping[str, Any] | None:
    return _in_file(lambda path: difference_of(path)[0], content)


def _in_file(
    shown: Callable[[Path], Mapping[str, Any] | None], content: bytes
) -> Mapping[str, Any] | None:
    """What a recording shows that is kept in a file meanwhile."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "piece.recording"
        path.write_bytes(content)
        return shown(path)


def _write(
    arguments: argparse.Namespace, test: Path, piece: Piece, run: str, faults: Sequence[str]
) -> None:
    span = f"{piece.begin / SECOND:.3f} to {piece.until / SECOND:.3f} s"
    about = f"{run}, {span}: it does as it did."
    if piece.difference is not None:
        about = f"{run}, {span}: {in_words(piece.difference)}."
    if faults:
        about += f" The run's recording is not whole: {'; '.join(faults)}."
    settings = f", settings={arguments.assignments!r}" if arguments.assignments else ""
    name = test.stem if test.stem.startswith("test_") else f"test_{test.stem}"
    kept = test.with_suffix(".recording")
    written = f"Written by `firmware-runtime replay {Path(arguments.run).name} --as-test`."
    texts = {"about": _in_docstring(about), "written": _in_docstring(written)}
    text = _TEST.format(**texts, name=name, settings=settings)
    keep_output(kept, piece.content, "--as-test")
    keep_output(test, text.encode(), "--as-test")
    if arguments.json:
        found = {"test": str(test), "recording": str(kept), "bytes": len(piece.content)}
        times = {"from_s": piece.begin / SECOND, "until_s": piece.until / SECOND}
        shown = {"steps": piece.steps, "difference": piece.difference, "faults": faults}
        said = {**found, **times, **shown}
        print(json.dumps(said, allow_nan=False))
        return
    steps = "1 step" if piece.steps == 1 else f"{piece.steps} steps"
    print(f"{test} and {kept} ({len(piece.content)} bytes): {steps}, {span}")
    if piece.difference is not None:
        print(f"  it shows: {in_words(piece.difference)}")
    for fault in faults:
        print(f"  the run's recording is not whole: {fault}")


def _in_docstring(text: str) -> str:
    """A text as Python reads it in a docstring, whatever is in it, in lines not too long."""
    quoted = repr(text)[1:-1].replace('"', '\\"')
    return "\n".join(wrap(quoted, _WIDTH, break_long_words=False, break_on_hyphens=False))
