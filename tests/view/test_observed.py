"""A run as the page sees it: by its recording alone, while it is written and afterwards."""

from collections.abc import Callable
from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.live.follower import Follower
from firmware_runtime.live.observed import Observed
from firmware_runtime.recording.blackbox.layout import file_of
from firmware_runtime.recording.blackbox.reader import read_recording
from tests.support.recorded import every_section, in_chunks, record

SPAN_S = 1.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("run") / "tachobot.recording", "tachobot", SPAN_S)


def test_all_of_a_recording_is_read_once(recording: Path, tmp_path: Path) -> None:
    copy = tmp_path / "x.recording"
    copy.write_bytes(in_chunks(recording, 20))
    with Follower(copy) as follower:
        assert follower.poll() == every_section(recording)
        assert not follower.has_gap
        assert follower.poll() == []


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
        assert follower.poll() == sections[:50]
        with growing.open("r+b") as file:
            file.seek(72)
            file.write(whole[72:80])
        assert follower.poll() == sections[50 : len(chunks[0].contents) - 1]


def _used_after(contents: list[bytes], sections: int) -> int:
    """Bytes of a chunk that are used by its header and so many sections."""
    return 16 + sum(8 + len(each) for each in contents[: sections + 1])


def test_a_reader_that_was_overtaken_says_so_and_goes_on(recording: Path, tmp_path: Path) -> None:
    chunks = read_recording(_chunked(recording, tmp_path)).chunks
    path = tmp_path / "ring.recording"
    path.write_bytes(file_of(chunks[:2]))
    with Follower(path) as follower:
        follower.poll()
        content = file_of([type(each)(each.number + 5, each.contents) for each in chunks[:2]])
        with path.open("r+b") as file:
            file.write(content)
        assert follower.poll() != []
        assert follower.has_gap


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
