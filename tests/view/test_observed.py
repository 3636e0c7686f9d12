"""A run as the page sees it: by its recording alone, while it is written and afterwards."""

from collections.abc import Callable
from itertools import islice
from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.live.follower import Follower
from firmware_runtime.live.observed import MOST_BEHIND, Observed
from firmware_runtime.recording.blackbox.layout import file_of
from firmware_runtime.recording.blackbox.reader import BEGINNINGS, kind_of, read_recording
from firmware_runtime.recording.blackbox.section import Kind
from tests.support.recorded import every_section, in_chunks, record

SPAN_S = 1.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("run") / "tachobot.recording", "tachobot", SPAN_S)


def test_all_of_a_recording_is_read_once(recording: Path, tmp_path: Path) -> None:
    copy = tmp_path / "x.recording"
    copy.write_bytes(in_chunks(recording, 20))
    with Follower(copy) as follower:
        assert list(follower.sections()) == every_section(recording)
        assert list(follower.sections()) == []


def test_one_that_is_left_goes_on_there(recording: Path, tmp_path: Path) -> None:
    copy = tmp_path / "x.recording"
    copy.write_bytes(in_chunks(recording, 20))
    sections = every_section(recording)
    with Follower(copy) as follower:
        assert list(islice(follower.sections(), 30)) == sections[:30]
        assert follower.chunks_behind == (len(sections) - 1) // 20 - 1
        assert list(follower.sections()) == sections[30:]


def test_what_a_run_appends_is_read_when_it_is_there(recording: Path, tmp_path: Path) -> None:
    chunks = read_recording(recording).chunks
    whole = file_of(chunks)
    growing = tmp_path / "x.recording"
    sections = every_section(recording)
    first = bytearray(whole)
    used = _used_after(chunks[0].contents, 50)
    first[72:80] = used.to_bytes(8, "little")
    growing.write_bytes(first)
    with Follower(growing) as follower:
        assert list(follower.sections()) == sections[:50]
        with growing.open("r+b") as file:
            file.seek(72)
            file.write(whole[72:80])
        assert list(follower.sections()) == sections[50 : len(chunks[0].contents) - 1]


def _used_after(contents: list[bytes], sections: int) -> int:
    """Bytes of a chunk that are used by its header and so many sections."""
    return 16 + sum(8 + len(each) for each in contents[: sections + 1])


def test_a_reader_that_was_overtaken_says_so_and_goes_on(recording: Path, tmp_path: Path) -> None:
    chunks = read_recording(_chunked(recording, tmp_path)).chunks
    path = tmp_path / "ring.recording"
    path.write_bytes(file_of(chunks[:2]))
    with Follower(path) as follower:
        seen = [*follower.sections()]
        content = file_of([type(each)(each.number + 5, each.contents) for each in chunks[:2]])
        with path.open("r+b") as file:
            file.write(content)
        assert list(follower.sections()) == [None, *seen]


def test_a_section_that_is_not_whole_yet_is_read_when_it_is(
    recording: Path, tmp_path: Path
) -> None:
    path = tmp_path / "x.recording"
    whole = file_of(read_recording(recording).chunks)
    sections = every_section(recording)
    place = whole.index(sections[50])
    path.write_bytes(whole[:place] + bytes(8) + whole[place + 8 :])
    with Follower(path) as follower:
        assert list(follower.sections()) == sections[:50]
        path.write_bytes(whole)
        assert list(follower.sections()) == sections[50:]


def test_a_section_that_stays_damaged_is_missing(recording: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.recording"
    content, sections = bytearray(in_chunks(recording, 20)), every_section(recording)
    content[content.index(sections[25]) + 4] ^= 1
    path.write_bytes(content)
    with Follower(path) as follower:
        assert list(follower.sections()) == [*sections[:25], None, *sections[40:]]


@pytest.mark.parametrize("behind", [0, 50])
def test_it_skips_to_where_a_replay_can_begin(recording: Path, tmp_path: Path, behind: int) -> None:
    path = tmp_path / "x.recording"
    path.write_bytes(in_chunks(recording, 20))
    sections = every_section(recording)
    steps = [kind_of(each) == Kind.STEP for each in sections]
    wanted = max(
        place
        for place, each in enumerate(sections)
        if kind_of(each) in BEGINNINGS and sum(steps[place:]) >= behind
    )
    with Follower(path) as follower:
        follower.skip_to_beginning(behind)
        assert list(follower.sections()) == sections[wanted:]


def test_a_page_that_is_too_far_behind_goes_on_at_the_present(
    recording: Path, tmp_path: Path
) -> None:
    path = tmp_path / "x.recording"
    chunks = read_recording(_chunked(recording, tmp_path)).chunks
    path.write_bytes(file_of(chunks))
    later = [type(each)(each.number + len(chunks) + MOST_BEHIND, each.contents) for each in chunks]
    with Observed(path) as observed:
        assert observed.poll()
        assert observed.remark is None
        with path.open("r+b") as file:
            file.write(file_of(later))
        assert observed.poll()
        assert observed.remark is not None
        assert "left out" in observed.remark


def _chunked(recording: Path, folder: Path) -> Path:
    path = folder / "chunked.recording"
    path.write_bytes(in_chunks(recording, 30))
    return path


def test_another_run_in_its_place_is_seen(recording: Path, tmp_path: Path) -> None:
    path = tmp_path / "x.recording"
    path.write_bytes(recording.read_bytes())
    with Follower(path) as follower:
        assert not follower.is_replaced
        other = tmp_path / "other"
        other.write_bytes(recording.read_bytes())
        other.replace(path)
        assert follower.is_replaced


@pytest.mark.parametrize("content", [b"", b"no recording", bytes(4096)])
def test_what_is_no_recording_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.recording"
    path.write_bytes(content)
    with pytest.raises(ConfigError):
        Observed(path)


def test_values_and_states_are_those_of_the_run(recording: Path) -> None:
    with Observed(recording, is_whole=True) as observed:
        assert observed.poll()
        assert not observed.poll()
    assert observed.at == round(SPAN_S * 1e9)
    assert observed.remark is None
    assert observed.end is not None
    assert "the run reached" in observed.end
    assert observed.states["imu"] == "sampling"
    assert observed.values["thrust_pairs.applied"] == "ALL"
    yaw = observed.numbers["world.yaw_rad"].since(-1.0, 10_000)
    assert len(yaw.times) > 20
    assert yaw.times == sorted(yaw.times)
    assert [name for _, name in observed.words["thrust_pairs"].entries][-1] == "driving"


def test_without_the_start_it_begins_at_a_keyframe(
    recording: Path, tmp_path: Path, rewrite_from_keyframe: Callable[[Path, Path], None]
) -> None:
    path = tmp_path / "x.recording"
    rewrite_from_keyframe(recording, path)
    with Observed(path) as observed:
        observed.poll()
    assert observed.at == round(SPAN_S * 1e9)
    assert observed.states["imu"] == "sampling"
