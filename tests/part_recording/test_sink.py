"""Handing over to the writer: never a wait in real time, and what goes wrong is said."""

import os
import signal
from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.part_recording.frames import frame, frames_of
from firmware_runtime.part_recording.sink import PIPE, ROOM, PipeSink
from firmware_runtime.recording.file_kind import PART_MAGIC

PIECE = frame(bytes(100_000))


def test_every_frame_is_in_the_file_when_it_is_closed(tmp_path: Path) -> None:
    path = tmp_path / "x.recording"
    sink = PipeSink(path, waits=True)
    for number in range(200):
        assert sink.take(frame(number.to_bytes(2, "big") * 20_000))
    assert sink.close() is None
    found = [int.from_bytes((content or b"")[:2], "big") for content in frames_of(path)]
    assert found == list(range(200))


def test_a_writer_that_stands_still_holds_up_nothing_and_loses_whole_frames(
    tmp_path: Path,
) -> None:
    path = tmp_path / "x.recording"
    sink = PipeSink(path, waits=False)
    os.kill(sink.writer, signal.SIGSTOP)
    os.waitid(os.P_PID, sink.writer, os.WSTOPPED | os.WNOWAIT)
    taken = [sink.take(PIECE) for _ in range((ROOM + PIPE) // len(PIECE) + 10)]
    os.kill(sink.writer, signal.SIGCONT)
    assert taken.count(False) > 0
    assert taken == sorted(taken, reverse=True)
    assert sink.close() is None
    assert list(frames_of(path)) == [bytes(100_000)] * taken.count(True)


def test_a_disk_that_is_full_is_said_at_the_end() -> None:
    sink = PipeSink(Path("/dev/full"), waits=True)
    sink.take(PIECE)
    said = sink.close()
    assert said is not None
    assert "ends early" in said


def test_a_writer_that_was_killed_is_said_at_the_end(tmp_path: Path) -> None:
    sink = PipeSink(tmp_path / "x.recording", waits=False)
    os.kill(sink.writer, signal.SIGKILL)
    os.waitid(os.P_PID, sink.writer, os.WEXITED | os.WNOWAIT)
    sink.take(PIECE)
    sink.take(PIECE)
    assert sink.close() is not None


def test_a_file_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="No such file"):
        PipeSink(tmp_path / "absent" / "x.recording", waits=True)


def test_the_file_begins_with_its_magic_number(tmp_path: Path) -> None:
    path = tmp_path / "x.recording"
    assert PipeSink(path, waits=True).close() is None
    assert path.read_bytes() == PART_MAGIC
