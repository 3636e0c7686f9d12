"""Writing and reading a statistics file, whole, damaged, and of a dead writer."""

import os
import stat
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics import reader as statistics_reader
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import STATISTICS, RunState
from firmware_runtime.statistics.layout import ELAPSED, SEQUENCE, STATE, WORST, Layout
from firmware_runtime.statistics.mapped_file import PREFIX, ReadableFile
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.watched_file import Watched


def overwrite(path: Path, offset: int, data: bytes) -> None:
    with path.open("r+b") as file:
        file.seek(offset)
        file.write(data)


def test_what_is_written_is_read(counted: StatisticsFile, path: Path) -> None:
    read = read_statistics(path)
    assert read.as_json() == counted.statistics().as_json()
    assert read.writer_alive
    assert read.complete


def test_without_a_path_nothing_touches_the_disk(
    layout: Layout, header: dict[str, Any], tmp_path: Path
) -> None:
    file = StatisticsFile(layout, header)
    assert file.statistics().state is RunState.RUNNING
    assert list(tmp_path.iterdir()) == []


def test_the_header_is_aligned_whatever_its_length(layout: Layout, path: Path) -> None:
    for length in range(9):
        header = {"models": {}, "conditions": {"board": "x" * length}}
        StatisticsFile(Layout(worst=layout.worst), header, path)
        assert PREFIX.unpack(path.read_bytes()[: PREFIX.size])[3] % 8 == 0
        assert read_statistics(path).header.board == "x" * length


def test_it_appears_under_its_name_only_and_others_may_not_write(
    file: StatisticsFile, path: Path
) -> None:
    assert [each.name for each in path.parent.iterdir()] == [path.name]
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert path.stat().st_size == PREFIX.unpack(path.read_bytes()[: PREFIX.size])[2]
    assert file.header.writer.pid == os.getpid()


def test_a_new_run_replaces_the_file_under_a_reader_of_the_old(
    counted: StatisticsFile, header: dict[str, Any], path: Path
) -> None:
    with path.open("rb") as old:
        StatisticsFile(counted.layout, header, path)
        assert read_statistics(path).as_json()["scheduled"] == 0
        assert len(old.read()) == os.fstat(old.fileno()).st_size


def test_a_directory_that_may_not_be_written_is_one_sentence(
    layout: Layout, header: dict[str, Any], tmp_path: Path
) -> None:
    (tmp_path / "taken").write_text("")
    with pytest.raises(StatisticsFileError, match=r"taken/tachobot\.stats: .* cannot be made"):
        StatisticsFile(layout, header, tmp_path / "taken" / "tachobot.stats")


def test_directories_that_are_missing_are_made(
    layout: Layout, header: dict[str, Any], tmp_path: Path
) -> None:
    path = tmp_path / "state" / "robots" / "tachobot.stats"
    StatisticsFile(layout, header, path)
    assert read_statistics(path).complete


def test_a_pipe_in_its_place_is_refused_and_stays(
    layout: Layout, header: dict[str, Any], path: Path
) -> None:
    os.mkfifo(path)
    with pytest.raises(StatisticsFileError, match=r"tachobot\.stats: .* cannot be made"):
        StatisticsFile(layout, header, path)
    assert path.is_fifo()


def test_no_file_is_one_sentence(path: Path) -> None:
    with pytest.raises(StatisticsFileError, match=r"cannot be read.*expected a run"):
        read_statistics(path)


@pytest.mark.parametrize("length", [0, 5, 8, 31, 32, 300, -8])
def test_a_file_cut_short_is_refused(file: StatisticsFile, path: Path, length: int) -> None:
    size = path.stat().st_size
    os.truncate(path, length if length >= 0 else size + length)
    with pytest.raises(StatisticsFileError, match="not a whole statistics file"):
        read_statistics(path)
    assert file.layout.cells > 0


def test_a_file_of_another_program_is_refused(path: Path) -> None:
    path.write_bytes(b"\x7fELF" * 100)
    with pytest.raises(StatisticsFileError, match=r"starts with .*ELF.*expected b'FWRTSTAT'"):
        read_statistics(path)


def test_a_file_of_another_version_is_refused(file: StatisticsFile, path: Path) -> None:
    overwrite(path, 8, struct.pack("=q", 1))
    with pytest.raises(StatisticsFileError, match=r"schema 1; this program reads schema 2"):
        read_statistics(path)
    assert file.layout.cells > 0


@pytest.mark.parametrize("header", [b"no JSON", b'{"layout":{}}', b'{"layout":3}', b"[]", b"9"])
def test_a_header_that_is_not_one_is_refused(
    file: StatisticsFile, path: Path, header: bytes
) -> None:
    overwrite(path, PREFIX.size, header.ljust(PREFIX.unpack(path.read_bytes()[:32])[3]))
    with pytest.raises(StatisticsFileError, match="header"):
        read_statistics(path)
    assert file.layout.cells > 0


def test_a_header_that_names_more_than_there_is_room_for_is_refused(
    file: StatisticsFile, path: Path
) -> None:
    whole = path.read_bytes()
    overwrite(path, 0, whole.replace(b'"worst":2', b'"worst":9'))
    with pytest.raises(StatisticsFileError, match=r"bytes of cells, expected"):
        read_statistics(path)
    assert file.layout.cells > 0


def test_a_section_that_stays_open_while_the_writer_lives_is_refused(
    counted: StatisticsFile, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(statistics_reader, "TIMEOUT_S", 0.0)
    counted.open_section()
    stands_still = f"process {os.getpid()} stands still and keeps .* half written"
    with pytest.raises(StatisticsFileError, match=stands_still):
        read_statistics(path)


def test_a_copy_during_which_a_section_was_written_is_made_again(
    counted: StatisticsFile, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def meanwhile() -> Iterator[None]:
        counted.open_section()
        yield
        counted.close_section(7)
        yield
        yield
        yield

    passing = meanwhile()
    monkeypatch.setattr(statistics_reader, "settle", lambda: next(passing))
    read = read_statistics(path)
    assert read.complete
    assert read.cells[SEQUENCE] == counted.cells[SEQUENCE]
    assert read.as_json()["conditions"]["run"]["elapsed_s"] == 7e-9


def test_stores_become_visible_before_a_copy_and_after_it(
    file: StatisticsFile, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[str] = []
    read = ReadableFile.read

    def noted(opened: ReadableFile, first: int = 0, size: int | None = None) -> bytes:
        done.append("cells" if size is None else "sequence")
        return read(opened, first, size)

    monkeypatch.setattr(ReadableFile, "read", noted)
    monkeypatch.setattr(statistics_reader, "settle", lambda: done.append("settle"))
    read_statistics(path)
    assert done[-5:] == ["sequence", "settle", "cells", "settle", "sequence"]
    assert file.layout.cells > 0


def test_a_file_that_is_watched_is_read_until_a_key_ends_it(
    counted: StatisticsFile, path: Path
) -> None:
    watched, seen = Watched(path), []
    for at, key in enumerate((b"", b"x", b" ", b"", b" ", b"q"), start=1):
        counted.close_section(at * SECOND)
        watched.obey(key)
        seen.append((watched.now.cells[ELAPSED] // SECOND, watched.is_wanted))
    assert seen == [(1, True), (2, True), (2, True), (2, True), (5, True), (6, False)]
    for key in (b"Q", b"\x03"):
        watched.obey(key)
        assert not watched.is_wanted


@pytest.mark.parametrize("beyond", [None, 0, 1 << 40])
def test_a_state_or_a_model_that_there_is_not_is_refused(
    counted: StatisticsFile, path: Path, beyond: int | None
) -> None:
    of_worst = counted.layout.place(0) + WORST.index("model")
    for cell, there_are in ((STATE, len(RunState)), (of_worst, len(counted.layout.models))):
        number = -1 if beyond is None else there_are + beyond
        before, counted.cells[cell] = counted.cells[cell], number
        with pytest.raises(StatisticsFileError, match="a state or a model that there is not"):
            read_statistics(path)
        counted.cells[cell] = before
    assert read_statistics(path).complete


def test_a_state_is_known_by_its_number_in_the_file(counted: StatisticsFile, path: Path) -> None:
    for number, state in enumerate(("RUNNING", "ENDED", "STOPPED", "FAILED", "OVERRUN")):
        counted.cells[STATE] = number
        assert read_statistics(path).state is RunState[state]


@pytest.mark.parametrize(
    ("name", "damage"),
    [
        ("writer", {"pid": 10**30, "started_ticks": 1, "boot_id": ""}),
        ("conditions", {"settings": {"cpus": {"asked": [], "reason": None}}}),
        ("models", {}),
        ("models", {"imu": {"period_ns": 0, "tolerance_ns": 1, "policy": "skip"}}),
        ("models", {"imu": {"period_ns": 1, "tolerance_ns": "1", "policy": "skip"}}),
        ("clock_speed", float("inf")),
        ("until_ns", "soon"),
        ("saved", {"writer_alive": True}),
        ("layout", {"models": "imu"}),
    ],
)
def test_a_header_whose_parts_are_no_use_is_refused(
    layout: Layout, header: dict[str, Any], path: Path, name: str, damage: object
) -> None:
    written = StatisticsFile(layout, header)
    table = {**written.header.as_json(), name: damage}
    path.write_bytes(STATISTICS.encode(table, layout.cells) + bytes(written.cells))
    with pytest.raises(StatisticsFileError, match="its header has no usable"):
        read_statistics(path)
