"""What is kept of recordings: pieces and copies, of a ring that is being written meanwhile."""

import os
from pathlib import Path

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, StatisticsFileError
from firmware_runtime.recording.blackbox.excerpts import Mirror, Pieces
from firmware_runtime.recording.blackbox.layout import CHUNK, MAGIC, PREFIX_SIZE, Size
from firmware_runtime.recording.blackbox.locations import persist
from firmware_runtime.recording.blackbox.reader import Recording, kind_of, read_recording
from firmware_runtime.recording.blackbox.ring import Ring
from firmware_runtime.recording.blackbox.ring_file import RingFile
from firmware_runtime.recording.blackbox.section import Kind, decode, encode
from tests.support.recorded import every_section, record

PID = os.getpid()
CHUNK_SIZE = 32_768
STEPS_IN_A_CHUNK = 4


class WrittenRing:
    """A ring that a test writes: a step a second, four in a chunk."""

    def __init__(self, path: Path, header: bytes, chunks: int) -> None:
        self.at = 0
        self._room = CHUNK_SIZE - CHUNK.size - 8 - len(header)
        self.ring = Ring(path, Size(CHUNK_SIZE, chunks), header)

    def steps(self, count: int) -> None:
        for _ in range(count):
            self.at += SECOND
            fill = b"x" * (self._room // STEPS_IN_A_CHUNK - 60)
            self.ring.write(section(Kind.STEP, self.at, fill))

    def end(self, state: str) -> None:
        self.ring.write(section(Kind.ENDED, self.at, {"state": state, "reason": "", "counts": {}}))


def section(kind: Kind, at: int, extra: object) -> bytes:
    return encode((kind.value, at, [], [], [], [], [], [], [], extra))


@pytest.fixture(scope="module")
def header(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A header section, of a run of this process."""
    path = record(tmp_path_factory.mktemp("run") / "x.recording", "detective", 0.01)
    return next(iter(read_recording(path).chunks)).contents[0]


class Rig:
    def __init__(self, folder: Path, header: bytes, budget: int, sync: int) -> None:
        self.statistics, self.header = folder / "robot.stats", header
        self.folder = folder / "kept"
        self.folder.mkdir()
        self.reported: list[str] = []
        self.pieces = Pieces(self.statistics, budget, sync, self.reported.append)
        self.number = 0

    def begin(self, chunks: int = 8) -> WrittenRing:
        """The next run: its ring takes the place of the last one's."""
        self.number += 1
        written = WrittenRing(self.statistics.with_suffix(".recording"), self.header, chunks)
        self.pieces.begin(self.folder / f"robot-{self.number:04}", PID)
        return written

    @property
    def files(self) -> list[str]:
        return sorted(path.stem for path in self.folder.iterdir())

    def read(self, name: str) -> Recording:
        return read_recording(self.folder / f"{name}.recording")

    def seconds(self, name: str) -> list[int]:
        """The instants of the steps in it."""
        sections = (each for chunk in self.read(name).chunks for each in chunk.contents)
        return [at(each) for each in sections if kind_of(each) == Kind.STEP]


@pytest.fixture
def rig(tmp_path: Path, header: bytes) -> Rig:
    return Rig(tmp_path, header, 1 << 30, 0)


def test_a_run_that_ended_well_leaves_nothing(rig: Rig) -> None:
    for state in ("ended", "stopped"):
        run = rig.begin()
        run.steps(3)
        run.end(state)
        rig.pieces.over()
    assert rig.files == []


@pytest.mark.parametrize("state", ["failed", "overrun", None])
def test_a_run_that_crashed_leaves_all_of_its_ring(rig: Rig, state: str | None) -> None:
    run = rig.begin()
    run.steps(9)
    if state is not None:
        run.end(state)
    rig.pieces.sync()  # which it does not ask for
    assert rig.files == []
    rig.pieces.over()
    assert rig.files == ["robot-0001-crash-1"]
    assert rig.seconds("robot-0001-crash-1") == list(range(1, 10))


def test_a_ring_that_the_next_run_has_replaced_is_not_lost(rig: Rig) -> None:
    run = rig.begin()
    run.steps(9)
    rig.pieces.poll(0)
    run.ring.close()
    WrittenRing(rig.statistics.with_suffix(".recording"), rig.header, 8)
    rig.pieces.over()
    assert rig.seconds("robot-0001-crash-1") == list(range(1, 10))


def test_another_processs_ring_is_none_of_the_run(rig: Rig) -> None:
    run = rig.begin()
    rig.pieces.begin(rig.folder / "robot-0002", PID + 1)
    run.steps(2)
    rig.pieces.over()
    assert rig.files == []


def test_a_crash_is_kept_once_by_recorders_that_were_started_again(rig: Rig) -> None:
    rig.begin().steps(1)
    rig.pieces.over()
    rig.pieces.begin(rig.folder / "robot-0001", PID)
    rig.pieces.over()
    assert rig.files == ["robot-0001-crash-1"]


def test_of_an_incident_the_last_minute_is_kept(rig: Rig) -> None:
    (rig.folder / "robot-0001-late-².recording").touch()  # somebody's, and no number
    run = rig.begin(chunks=64)
    run.steps(200)
    rig.pieces.keep("late", 1)
    first, *_, last = rig.seconds("robot-0001-late-1")
    assert last == 200
    assert 140 - STEPS_IN_A_CHUNK <= first <= 140


def test_the_oldest_make_room_and_what_is_larger_than_all_is_not_kept(
    tmp_path: Path, header: bytes
) -> None:
    rig = Rig(tmp_path, header, 5 * CHUNK_SIZE, 0)
    rig.begin().steps(2 * STEPS_IN_A_CHUNK)
    for number in (1, 2, 3):
        rig.pieces.keep("late", number)
    assert rig.files == ["robot-0001-late-2", "robot-0001-late-3"]
    rig.begin().steps(7 * STEPS_IN_A_CHUNK)
    rig.pieces.over()
    assert rig.files == ["robot-0001-late-2", "robot-0001-late-3"]
    assert "more than the budget" in rig.reported[-1]


def test_what_does_not_fit_beside_the_copy_that_grows_is_not_kept(
    tmp_path: Path, header: bytes
) -> None:
    rig = Rig(tmp_path, header, 6 * CHUNK_SIZE, SECOND)
    rig.begin(chunks=4).steps(3 * STEPS_IN_A_CHUNK)
    rig.pieces.poll(0)
    rig.pieces.keep("late", 1)
    assert rig.files == ["robot-0001"]


def test_the_copy_grows_with_each_sync_and_wraps_as_the_ring_does(
    tmp_path: Path, header: bytes
) -> None:
    rig = Rig(tmp_path, header, 1 << 30, SECOND)
    run = rig.begin(chunks=4)
    for second in range(1, 41):
        run.steps(1)
        rig.pieces.poll(second * SECOND)
        seconds = rig.seconds("robot-0001")
        assert seconds == list(range(seconds[0], second + 1))
        assert rig.read("robot-0001").faults() == []
        assert len(seconds) >= min(second, 3 * STEPS_IN_A_CHUNK)


def test_the_copy_has_what_came_behind_its_last_sync_when_the_run_is_over(
    tmp_path: Path, header: bytes
) -> None:
    rig = Rig(tmp_path, header, 1 << 30, 10 * SECOND)
    run = rig.begin()
    run.steps(1)
    rig.pieces.poll(SECOND)
    run.steps(2)
    run.end("ended")
    rig.pieces.over()
    assert rig.seconds("robot-0001") == [1, 2, 3]


def test_between_syncs_nothing_is_written(tmp_path: Path, header: bytes) -> None:
    rig = Rig(tmp_path, header, 1 << 30, 10 * SECOND)
    run = rig.begin()
    for now in range(0, 20 * SECOND, SECOND // 2):
        run.steps(1)
        rig.pieces.poll(now)
    assert len(rig.seconds("robot-0001")) == 21


def test_a_disk_that_lost_power_between_data_and_its_word_for_it_has_whole_sections(
    tmp_path: Path, header: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, copy = tmp_path / "x.recording", tmp_path / "copy.recording"
    run = WrittenRing(path, header, 4)
    ring = RingFile(path)
    mirror = Mirror(ring, copy)
    run.steps(30)
    mirror.sync()
    run.steps(5)

    def power_goes(_descriptor: int) -> None:
        raise OSError("power")

    monkeypatch.setattr("os.fdatasync", power_goes)
    with pytest.raises(OSError, match="power"):
        mirror.sync()
    assert read_recording(copy).faults() == []
    ring.close()
    for _ in range(3):
        mirror.close()


def test_a_chunk_that_is_written_over_while_it_is_read_is_left_out(
    tmp_path: Path, header: bytes
) -> None:
    path = tmp_path / "x.recording"
    run = WrittenRing(path, header, 3)
    run.steps(3 * STEPS_IN_A_CHUNK)
    with RingFile(path) as ring:
        slot = ring.slot(0)
        assert ring.content(0, 0, slot) is not None
        run.steps(1)  # into the place of the oldest
        assert ring.content(0, 0, slot) is None
        assert [each.number for each in ring.chunks()] == [2, 3, 4]


def test_a_folder_that_goes_away_is_an_error_with_its_name(rig: Rig) -> None:
    rig.begin().steps(1)
    rig.folder.rmdir()
    with pytest.raises(StatisticsFileError, match="kept"):
        rig.pieces.keep("late", 1)


def test_what_is_no_ring_has_nothing_in_it(tmp_path: Path) -> None:
    path = tmp_path / "x.recording"
    path.write_bytes(MAGIC + bytes(PREFIX_SIZE))
    with RingFile(path) as file:
        assert (file.count, file.header(), file.chunks()) == (0, None, [])


def at(content: bytes) -> int:
    return decode(content).at // SECOND


def test_sections_of_a_real_run_are_kept_as_they_are(rig: Rig, tmp_path: Path) -> None:
    path = record(tmp_path / "y.recording", "detective", 0.1)
    with RingFile(path) as ring:
        kept = [each for chunk in ring.chunks() for each in chunk.contents[1:]]
    assert kept == every_section(path)
    assert rig.files == []


def test_what_a_session_has_recorded_is_copied_once_if_it_fits(tmp_path: Path) -> None:
    path, folder = record(tmp_path / "x.recording", "detective", 0.1), tmp_path / "persisted"
    assert persist(tmp_path / "none.recording", folder, 1 << 30) is None
    with pytest.raises(ConfigError, match=r"are more than recording\.keep_mib"):
        persist(path, folder, 1000)
    older = folder / "older.recording"
    older.write_bytes(bytes(1 << 20))
    copy = persist(path, folder, 1 << 20)
    assert copy is not None
    assert list(folder.iterdir()) == [copy]  # the older one has made room
    assert copy.stem == read_recording(path).header.run
    assert every_section(copy) == every_section(path)
    assert persist(path, folder, 1 << 30) is None


def test_a_copy_is_brought_up_to_this_moment_on_request(tmp_path: Path, header: bytes) -> None:
    rig = Rig(tmp_path, header, 1 << 30, 10 * SECOND)
    run = rig.begin()
    run.steps(1)
    rig.pieces.poll(SECOND)
    run.steps(2)
    rig.pieces.poll(2 * SECOND)
    rig.pieces.sync()
    rig.pieces.close()
    still_open = {each.resolve() for each in Path("/proc/self/fd").iterdir()}
    assert rig.folder / "robot-0001.recording" not in still_open
    assert rig.seconds("robot-0001") == [1, 2, 3]
