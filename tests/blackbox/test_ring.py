"""A recording that lacks something says so, and its run goes on."""

import errno
import itertools
import os
import re
from collections.abc import Callable, Container
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, legible
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.recording.blackbox import steps
from firmware_runtime.recording.blackbox.keyframe_schedule import KeyframeSchedule
from firmware_runtime.recording.blackbox.layout import (
    CHUNK,
    PREFIX_SIZE,
    SECTION,
    Size,
    most,
    parts_of,
    size_for,
)
from firmware_runtime.recording.blackbox.reader import kind_of, read_recording
from firmware_runtime.recording.blackbox.ring import AHEAD, ALL, STEP, Ring, SectionTooLarge
from firmware_runtime.recording.blackbox.section import Kind, encode, encode_into
from firmware_runtime.recording.blackbox.writer import Pending, Writer
from firmware_runtime.recording.board_of_recording import board_of_table
from firmware_runtime.recording.replay.verdict import replay
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.file_header import RunState

SIZE = Size(16_384, 3)
HEADER = b"h" * 100
BOARD = board_in_force("detective", ())
CHUNK_SIZE = size_for(BOARD.loads.values(), BOARD.settings.recording.minutes).chunk_bytes


def _full(*_: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _run(path: Path, span_s: float = 1) -> tuple[Outcome, list[str]]:
    said: list[str] = []
    session = start_session(
        BOARD,
        VirtualClock(),
        doubles=True,
        statistics_path=None,
        recording=path,
        log=said.append,
    )
    try:
        return session.run(round(span_s * SECOND)), said
    finally:
        session.close()


def test_a_section_that_no_chunk_can_hold_is_refused_and_the_next_is_written(
    tmp_path: Path,
) -> None:
    ring = Ring(tmp_path / "x.recording", SIZE, HEADER)
    with pytest.raises(SectionTooLarge, match="16384 bytes"):
        ring.write(bytes(SIZE.chunk_bytes))
    assert ring.write(b"next") is False
    ring.close()
    assert ring.memory.closed
    assert ring.path not in {each.resolve() for each in Path("/proc/self/fd").iterdir()}
    content = (tmp_path / "x.recording").read_bytes()
    number, used = CHUNK.unpack_from(content, PREFIX_SIZE)
    assert (number, used) == (1, CHUNK.size + 2 * SECTION.size + len(HEADER) + len(b"next"))


def test_a_header_that_leaves_no_room_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="header of 13000 bytes"):
        Ring(tmp_path / "x.recording", SIZE, bytes(13_000))
    assert list(tmp_path.iterdir()) == []


def test_a_recording_takes_a_sixteenth_of_a_small_computers_memory_at_most(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    memory = {"SC_PHYS_PAGES": (416 << 20) // 4096, "SC_PAGE_SIZE": 4096}
    monkeypatch.setattr(os, "sysconf", memory.__getitem__)
    assert most() == 26 << 20


def test_sections_are_parted_where_no_more_fit_and_one_that_is_too_long_stands_alone() -> None:
    room = 2 * (SECTION.size + 5)
    contents = [b"11111", b"22222", b"33333", bytes(room), b"44444"]
    parts = list(parts_of(contents, room))
    assert parts == [contents[:2], contents[2:3], contents[3:4], contents[4:]]


def test_more_than_there_is_room_for_is_refused_at_once(tmp_path: Path) -> None:
    free = os.statvfs(tmp_path)
    size = Size(free.f_bavail * free.f_frsize // CHUNK_SIZE * CHUNK_SIZE, 2)
    with pytest.raises(ConfigError, match=r"cannot be made \(No space left"):
        Ring(tmp_path / "x.recording", size, HEADER)
    assert list(tmp_path.iterdir()) == []


def test_every_page_that_is_written_to_has_been_taken_and_no_more_than_a_way_ahead(
    tmp_path: Path,
) -> None:
    path, size = tmp_path / "x.recording", Size(2 * AHEAD, 3)
    ring = Ring(path, size, HEADER)
    for _ in range(3 * size.bytes // 15_000):
        ring.write(bytes(15_000))
        taken = path.stat().st_blocks * 512
        if ring.has_wrapped:
            assert taken >= size.bytes
        else:
            assert ring.place <= taken <= ring.place + 2 * AHEAD
    assert ring.has_wrapped
    ring.close()


def test_it_is_filled_ahead_in_small_steps_until_all_of_it_is(tmp_path: Path) -> None:
    path = tmp_path / "x.recording"
    ring = Ring(path, Size(AHEAD, 2), HEADER)
    filled = [ring.filled]
    while ring.filled < ALL:
        ring.fill_ahead()
        filled.append(ring.filled)
    assert {after - before for before, after in pairwise(filled[:-1])} == {STEP}
    assert path.stat().st_blocks * 512 >= 2 * AHEAD
    ring.close()


@pytest.mark.skipif(
    tuple(map(int, os.uname().release.split(".")[:2])) < (5, 14), reason="needs Linux 5.14"
)
def test_what_is_filled_is_mapped_wherever_it_begins(tmp_path: Path) -> None:
    path = tmp_path / "x.recording"
    ring = Ring(path, Size(AHEAD, 2), HEADER)
    ring.fill_ahead(STEP + 1000)
    ring.fill_ahead(STEP + 1000)
    assert _mapped_bytes(path) >= ring.filled
    ring.close()


def _mapped_bytes(path: Path) -> int:
    """How much of a file this process has in its memory."""
    _, _, of_file = Path("/proc/self/smaps").read_text().partition(str(path))
    return 1024 * int(re.findall(r"Rss: +(\d+) kB", of_file)[0])


def test_no_room_for_the_next_chunk_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ring = Ring(tmp_path / "x.recording", Size(AHEAD, 2), HEADER)
    monkeypatch.setattr(os, "posix_fallocate", _full)
    ring.write(bytes(AHEAD - 1000))
    with pytest.raises(OSError, match="No space"):
        ring.write(bytes(AHEAD - 1000))
    ring.close()


def test_a_writer_puts_what_came_early_into_its_ring_and_knows_when_that_has_wrapped(
    tmp_path: Path,
) -> None:
    path, writer = tmp_path / "x.recording", Writer(Pending(), KeyframeSchedule())
    for content in (b"came early", bytes(AHEAD)):
        writer.put(content, Kind.BUILD, 0)
    assert not writer.is_kept
    writer.open(lambda: Ring(path, Size(AHEAD, 2), HEADER))
    assert (writer.is_kept, writer.early, writer.fault) == (True, [], None)
    content = path.read_bytes()
    assert b"came early" in content
    assert f"build: {AHEAD} bytes are more than a chunk has room for".encode() in content
    wrapped = []
    for _ in range(3):
        writer.put(bytes(AHEAD - 1000), Kind.STEP, 0)
        wrapped.append(writer.has_wrapped)
    assert wrapped == [False, False, True]


@pytest.mark.parametrize("size", [AHEAD // 2, AHEAD], ids=["next", "too large, which is said"])
def test_a_writer_ends_where_there_is_no_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    writer = Writer(Pending(), KeyframeSchedule())
    ring = Ring(tmp_path / "x.recording", Size(AHEAD, 2), HEADER)
    writer.open(lambda: ring)
    monkeypatch.setattr(os, "posix_fallocate", _full)
    for size_of_step in (AHEAD - 150, STEP - 230):  # of five steps that are filled
        writer.put(bytes(size_of_step), Kind.STEP, 0)
    assert writer.fault is None
    writer.put(bytes(size), Kind.STEP, 0)
    assert "before the run does (No space" in str(writer.fault)
    assert (writer.ring, writer.has_wrapped, ring.memory.closed) == (None, False, True)


def test_a_run_goes_on_where_its_recording_has_no_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = iter([os.posix_fallocate])  # for one chunk

    def allocate(*of: int) -> None:
        next(left, _full)(*of)

    monkeypatch.setattr(os, "posix_fallocate", allocate)
    monkeypatch.setattr(steps, "encode_into", _larger_by(CHUNK_SIZE // 5, range(100)))
    outcome, said = _run(tmp_path / "x.recording")
    assert outcome.state is RunState.ENDED
    assert len(said) == 1
    assert "No space" in said[0]
    recording = read_recording(tmp_path / "x.recording")
    assert recording.faults() == []
    assert len(recording.chunks) == 1


@pytest.mark.slow
def test_a_section_that_is_missing_is_said_and_what_follows_is_identical(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "x.recording"
    monkeypatch.setattr(steps, "encode_into", _larger_by(CHUNK_SIZE, [20]))
    assert _run(path, 2)[0].state is RunState.ENDED
    recording = read_recording(path)
    (fault,) = recording.faults()
    assert "a section is missing: step: " in fault
    first, second = recording.segments()
    assert kind_of(first.contents[0]) != kind_of(second.contents[0]) == Kind.KEYFRAME
    header = recording.header
    verdict = replay(recording, board_of_table(header.source, header.table))
    assert (verdict.first, verdict.differences, verdict.faults) == (None, 0, [fault])
    assert not verdict.is_identical


def _larger_by(size: int, places: Container[int]) -> Callable[[list[Any], bytearray], None]:
    """What encodes the sections of steps, those at these places so many bytes larger."""
    count = itertools.count()

    def encode(fields: list[Any], buffer: bytearray) -> None:
        *usual, extra = fields
        encode_into([*usual, bytes(size) if next(count) in places else extra], buffer)

    return encode


def test_a_text_that_utf_8_has_not_is_no_section_but_can_be_made_legible() -> None:
    with pytest.raises(UnicodeEncodeError):
        encode((Kind.ENDED.value, 0, [], [], [], [], [], [], [], "a\udc80"))
    assert legible("a\udc80") == "a\\udc80"
    assert legible("straße") == "straße"
