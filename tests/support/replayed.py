"""Recordings replayed by the settings that they hold."""

from pathlib import Path

from firmware_runtime.board.registry import Board
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.replay.stretch import WHOLE, Stretch
from firmware_runtime.recording.replay.verdict import Verdict, replay


def opened(path: Path) -> tuple[Recording, Board]:
    """The recording at a path, and its board."""
    recording = read_recording(path)
    return recording, board_of(recording.header)


def replayed(path: Path, stretch: Stretch = WHOLE) -> Verdict:
    """What a replay of the recording at a path finds."""
    return replay(*opened(path), stretch)


def check_identical(path: Path, steps: int = 10, stretch: Stretch = WHOLE) -> Verdict:
    """Assert that a run of so many steps or more is its replay."""
    verdict = replayed(path, stretch)
    assert verdict.first is None, str(verdict.first)[:300]
    assert verdict.faults == []
    assert verdict.is_identical
    assert verdict.steps > steps
    return verdict
