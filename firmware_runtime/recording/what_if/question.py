"""A question to a recording, which another process can be asked as well: JSON both ways."""

from collections.abc import Callable
from pathlib import Path

from msgspec import Struct

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from firmware_runtime.recording.blackbox.section import Section
from firmware_runtime.recording.changed_settings import changed_board
from firmware_runtime.recording.replay.open_player import Change
from firmware_runtime.recording.replay.verdict import Stretch
from firmware_runtime.recording.what_if.what_if import WhatIf, most_different, what_if


class Question(Struct, kw_only=True):
    """What is to be found out."""

    recording: str
    """The file's path."""
    assignments: list[str] = []
    begin: int = 0
    until: int = NEVER
    plots: int = 0
    """Of how many outputs curves are wanted."""


def answer(
    question: Question,
    before: Callable[[Section], None] = lambda _: None,
    board: Board | None = None,
) -> WhatIf:
    """Find it out, by the code of this process; `board` in place of the run's and what is set.

    Raises ConfigError.
    """
    recording = read_recording(Path(question.recording))
    stretch = Stretch(question.begin, question.until)
    change = _change(question, recording, board)
    found = what_if(recording, change, stretch, before=before)
    found.settings = question.assignments
    if question.plots and not found.identical:
        drawn = frozenset(most_different(found, question.plots))
        found.curves = what_if(recording, change, stretch, before=before, drawn=drawn).curves
    return found


def _change(question: Question, recording: Recording, board: Board | None) -> Change:
    header = recording.header
    if board is not None and board.kind != header.kind:
        fault = f"a recording of a {header.kind}; expected settings of one, not of a {board.kind}"
        raise ConfigError.of_one("replay", fault)
    return Change(board or changed_board(header, question.assignments), changed_board(header, ()))
