"""Recordings replayed by the settings that they hold."""

from pathlib import Path

from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.board_of_recording import board_of_table
from firmware_runtime.recording.replay.verdict import Verdict, replay


def replayed(path: Path) -> Verdict:
    """What a replay of the recording at a path finds."""
    recording = read_recording(path)
    header = recording.header
    return replay(recording, board_of_table(header.source, header.table))


def check_identical(path: Path, steps: int = 10) -> Verdict:
    """Assert that a run of so many steps or more is its replay."""
    verdict = replayed(path)
    assert verdict.first is None, str(verdict.first)[:300]
    assert verdict.faults == []
    assert verdict.is_identical
    assert verdict.steps > steps
    return verdict
