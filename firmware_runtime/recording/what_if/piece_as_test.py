"""A piece of a recorded run as a test: the shortest that shows a difference, and its text."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import wrap
from typing import Any

from msgspec.structs import replace

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.reader import Recording
from firmware_runtime.recording.board_of_recording import changed_board
from firmware_runtime.recording.replay.replay_assertion import difference_of, in_words
from firmware_runtime.recording.replay.stretch import Stretch
from firmware_runtime.recording.replay.verdict import Verdict, replay
from firmware_runtime.recording.what_if.checkout import ask
from firmware_runtime.recording.what_if.piece import Cutter, Piece
from firmware_runtime.recording.what_if.what_if import Question, answer

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


def piece_of(
    recording: Recording, question: Question, checkout: Path | None
) -> tuple[Piece, Verdict]:
    """The piece of a run, and how the run was replayed.

    It shows where the run is not its replay; or else what the question's settings, or the code of a
    checkout, change; or else it is the question's stretch. Raises ConfigError if nothing changes.
    """
    board = changed_board(recording.header, ())
    stretch = Stretch(question.begin, question.until)
    verdict = replay(recording, board, stretch)
    if verdict.first is not None:
        cutter = Cutter(recording, board, _shown_here)
        return cutter.around(verdict.first.at, is_true=False), verdict
    if checkout is None and not question.assignments:
        return Cutter(recording, board, _shown_here).stretch(stretch), verdict
    first = _difference(question, checkout)
    if first is None:
        fault = "no output would have been another; expected a difference, or nothing that changes"
        raise ConfigError.of_one("--as-test", fault)
    asked = partial(_asked_of_file, question, checkout)
    shows = partial(_in_file, asked)
    return Cutter(recording, board, shows).around(first["t_ns"], is_true=True), verdict


def span_of_piece(piece: Piece) -> str:
    """From and to which second of its run it goes."""
    return f"{piece.begin / SECOND:.3f} to {piece.until / SECOND:.3f} s"


def test_of_piece(
    piece: Piece, recording: Recording, faults: Sequence[str], name: str, assignments: Sequence[str]
) -> str:
    """The source of a test of a piece, which looks for its recording beside itself."""
    about = f"{recording.header.run}, {span_of_piece(piece)}: it does as it did."
    if piece.difference is not None:
        shown = in_words(piece.difference)
        about = f"{recording.header.run}, {span_of_piece(piece)}: {shown}."
    if faults:
        about += f" The run's recording is not whole: {'; '.join(faults)}."
    settings = f", settings={list(assignments)!r}" if assignments else ""
    written = f"Written by `firmware-runtime replay {recording.path.name} --as-test`."
    texts = {"about": _in_docstring(about), "written": _in_docstring(written)}
    name = name if name.startswith("test_") else f"test_{name}"
    return _TEST.format(**texts, name=name, settings=settings)


def _difference(question: Question, checkout: Path | None) -> Mapping[str, Any] | None:
    """The first difference that the settings, or the code of a checkout, make."""
    found = answer(question) if checkout is None else ask(question, checkout)
    return found.first_difference


def _asked_of_file(
    question: Question, checkout: Path | None, path: Path
) -> Mapping[str, Any] | None:
    """The same of a recording that is a file of its own, from end to end."""
    whole = replace(question, recording=str(path.absolute()), begin=0, until=NEVER)
    return _difference(whole, checkout)


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


def _in_docstring(text: str) -> str:
    """A text as Python reads it in a docstring, whatever is in it, in lines not too long."""
    quoted = repr(text)[1:-1].replace('"', '\\"')
    return "\n".join(wrap(quoted, _WIDTH, break_long_words=False, break_on_hyphens=False))
