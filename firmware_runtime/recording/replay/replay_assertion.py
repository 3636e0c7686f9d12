"""The assertion of a test that `firmware-runtime replay RUN --as-test FILE` writes.

def test_that_day() -> None:
assert_replays(Path(__file__).with_suffix(".recording"))
"""

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from firmware_runtime.devs.time import format_time
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.board_of_recording import changed_board
from firmware_runtime.recording.replay.difference import where_of
from firmware_runtime.recording.replay.open_player import Change
from firmware_runtime.recording.replay.verdict import replay
from firmware_runtime.recording.what_if.what_if import what_if


def assert_replays(recording: "str | PathLike[str]", *, settings: Sequence[str] = ()) -> None:
    """Raise AssertionError unless the robot does on a recording what it did then, to the bit.

    `settings` are tried in place of the run's, `KEY=VALUE`: outputs have to be the same with them.
    Raises ConfigError for a file of which nothing can be used.
    """
    __tracebackhide__ = True
    first, faults = difference_of(Path(recording), settings)
    if first is not None:
        raise AssertionError(in_words(first))
    if faults:
        raise AssertionError(f"{recording} is not whole: {'; '.join(faults)}")


def difference_of(
    path: Path, settings: Sequence[str] = ()
) -> tuple[Mapping[str, object] | None, Sequence[str]]:
    """The first difference, as `Difference.as_json` has it, and what the recording lacks."""
    recording = read_recording(path)
    header = recording.header
    recorded = changed_board(header, ())
    if not settings:
        verdict = replay(recording, recorded)
        return None if verdict.first is None else verdict.first.as_json(), verdict.faults
    found = what_if(recording, Change(changed_board(header, settings), recorded))
    return found.first_difference, found.faults


def in_words(difference: Mapping[str, Any]) -> str:
    """A difference as one sentence."""
    where = where_of(difference["model"], difference["field"])
    recorded, replayed = (json.dumps(difference[key]) for key in ("recorded", "replayed"))
    at = format_time(difference["t_ns"])
    return f"{difference['what']} of {where} at {at}: {recorded} was recorded, {replayed} replayed"
