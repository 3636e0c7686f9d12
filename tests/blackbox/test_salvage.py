"""What is whole of a damaged recording is saved: no section more is lost than was touched."""

import random
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.excerpts import Mirror
from firmware_runtime.recording.blackbox.layout import (
    CHUNK,
    MAGIC,
    PREFIX,
    PREFIX_SIZE,
    SECTION,
    Chunk,
    file_of,
)
from firmware_runtime.recording.blackbox.reader import kind_of
from firmware_runtime.recording.blackbox.ring_file import RingFile, whole_content_of
from firmware_runtime.recording.blackbox.salvage import Saved, save
from firmware_runtime.recording.blackbox.section import Kind
from tests.support.recorded import in_chunks, record, recording_in

PATH = Path("damaged.recording")
IN_A_CHUNK = 8


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Chunks of eight sections."""
    path = tmp_path_factory.mktemp("recordings") / "whole.recording"
    return in_chunks(record(path, "detective", 0.5), IN_A_CHUNK)


def sections_of(content: bytes) -> list[bytes]:
    chunks = recording_in(content).chunks
    every = [each for chunk in chunks for each in chunk.contents]
    return [each for each in every if kind_of(each) != Kind.HEADER]


def chunks_of(content: bytes) -> range:
    """Where each chunk begins."""
    _, size, count = PREFIX.unpack_from(content)
    return range(PREFIX_SIZE, PREFIX_SIZE + count * size, size)


def places(content: bytes) -> Iterator[tuple[int, int]]:
    """Begin and end of each section but the headers, with what stands before it."""
    for begin in chunks_of(content):
        used = CHUNK.unpack_from(content, begin)[1]
        place = begin + CHUNK.size
        while place < begin + used:
            end = place + SECTION.size + SECTION.unpack_from(content, place)[0]
            if kind_of(content[place + SECTION.size :]) != Kind.HEADER:
                yield place, end
            place = end


def saved(content: bytes) -> tuple[Saved, list[bytes]]:
    """What is saved, and its sections as a reader finds them: it is whole but for gaps."""
    done = save(PATH, content)
    assert all("missing" in fault for fault in recording_in(done.content).faults())
    return done, sections_of(done.content)


def test_of_a_whole_one_nothing_is_lost(whole: bytes) -> None:
    done, sections = saved(whole)
    assert (done.lost, sections) == ([], sections_of(whole))
    recording = recording_in(done.content)
    assert (recording.is_from_start, recording.faults()) == (True, [])
    assert len(sections) > 3 * IN_A_CHUNK


@pytest.mark.slow
def test_a_wrong_byte_costs_its_own_section_and_no_other(whole: bytes) -> None:
    every = sections_of(whole)
    for number, (begin, end) in enumerate(places(whole)):
        damaged = bytearray(whole)
        damaged[(begin + end) // 2] ^= 0x10
        done, sections = saved(bytes(damaged))
        assert sections == every[:number] + every[number + 1 :], number
        assert len(done.lost) == 1
        if 0 < number < len(every) - 1:  # a gap stays one
            (fault,) = recording_in(done.content).faults()
            assert "is missing" in fault


@pytest.mark.slow
def test_a_cut_costs_what_was_cut(whole: bytes) -> None:
    every, ends = sections_of(whole), [end for _, end in places(whole)]
    for cut in range(ends[0], len(whole), 997):
        _, sections = saved(whole[:cut])
        assert sections == every[: sum(end <= cut for end in ends)]


def test_a_header_that_is_damaged_costs_nothing(whole: bytes) -> None:
    for begin in chunks_of(whole):
        damaged = bytearray(whole)
        damaged[begin + CHUNK.size + 100] ^= 0x40
        done, sections = saved(bytes(damaged))
        assert (sections, done.lost) == (sections_of(whole), [])
        assert recording_in(done.content).is_from_start


@pytest.mark.parametrize("lost", [1, 40, PREFIX_SIZE])
def test_a_file_without_its_beginning_is_read_by_its_headers(whole: bytes, lost: int) -> None:
    done, sections = saved(whole[lost:])
    assert sections == sections_of(whole)
    assert done.lost == []


def test_bytes_that_are_missing_in_the_middle_cost_one_chunk_at_most(whole: bytes) -> None:
    places_of = list(places(whole))
    begin, end = places_of[IN_A_CHUNK + 3][0], places_of[IN_A_CHUNK + 5][1]
    done, sections = saved(whole[: begin + 3] + whole[end - 5 :])
    in_the_middle, _ = done.lost
    assert in_the_middle == "8 bytes of chunk 2 after 0.050 s before 0.077 s"
    every = sections_of(whole)
    assert [each for each in sections if each not in every] == []
    assert sections == every[: IN_A_CHUNK + 3] + every[IN_A_CHUNK + 6 :]


def test_a_chunk_that_is_missing_stays_a_gap_and_is_named(whole: bytes) -> None:
    first, _, *others = recording_in(whole).chunks
    done, _ = saved(file_of([first, *others]))
    assert done.lost == ["chunks 2 to 2"]
    assert recording_in(done.content).faults() == ["chunk 2 is missing"]


def test_of_a_file_without_a_header_nothing_is_saved() -> None:
    with pytest.raises(ConfigError, match="no header of a recording"):
        save(PATH, MAGIC + bytes(100_000))


@pytest.mark.slow
def test_what_is_saved_of_a_file_with_many_gaps_is_not_much_larger_than_it(whole: bytes) -> None:
    header, every = recording_in(whole).chunks[0].contents[0], sections_of(whole)
    damaged = bytearray(file_of([Chunk(1, [header, *every]), Chunk(2, [header, *every * 20])]))
    touched = list(places(bytes(damaged)))[: len(every) : 2]
    for begin, _ in touched:
        damaged[begin + SECTION.size + 4] ^= 1
    done, _ = saved(bytes(damaged))
    assert done.sections == 21 * len(every) - len(touched)
    assert len(done.content) < 3 * len(damaged)


# One damage of some KiB to a short run -----------------------------------------------------------

SEEDS = range(25)
MOST = 5 << 10
Damage = Callable[[random.Random, int], bytes]


def noise(chance: random.Random, length: int) -> bytes:
    return chance.randbytes(length)


def zeros(_: random.Random, length: int) -> bytes:
    return bytes(length)


def ones(_: random.Random, length: int) -> bytes:
    return b"\xff" * length


@pytest.fixture(scope="module")
def ring(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A run that has not filled its first chunk."""
    path = tmp_path_factory.mktemp("recordings") / "ring.recording"
    return whole_content_of(record(path, "detective", 0.5))


def check(ring: bytes, begin: int, end: int, content: bytes) -> None:
    """What is saved of the ring with that in place of these bytes is all that they have not hit."""
    damaged = ring[:begin] + content + ring[end:]
    expected = [
        ring[place + SECTION.size : after]
        for place, after in places(ring)
        if after <= begin or place >= end or damaged[place:after] == ring[place:after]
    ]
    recording = recording_in(save(PATH, damaged).content)
    assert [each for chunk in recording.chunks for each in chunk.contents[1:]] == expected
    assert recording.header == recording_in(ring).header


@pytest.mark.slow
@pytest.mark.parametrize("damage", [noise, zeros, ones], ids=lambda each: each.__name__)
def test_what_lies_beyond_the_damage_is_saved(ring: bytes, damage: Damage) -> None:
    *_, (_, last) = places(ring)
    for seed in SEEDS:
        chance = random.Random(seed)  # noqa: S311 -- repeatable, not secret
        begin, length = chance.randrange(last), chance.randint(1, MOST)
        check(ring, begin, begin + length, damage(chance, length))


@pytest.mark.slow
@pytest.mark.parametrize("damage", [noise, zeros, ones], ids=lambda each: each.__name__)
@pytest.mark.parametrize("begin", [0, 8, PREFIX_SIZE, PREFIX_SIZE + CHUNK.size])
def test_a_beginning_that_is_damaged_costs_the_sections_in_it(
    ring: bytes, begin: int, damage: Damage
) -> None:
    for length in (1, CHUNK.size, PREFIX_SIZE, 1 << 10, MOST):
        chance = random.Random(length)  # noqa: S311 -- as above
        check(ring, begin, begin + length, damage(chance, length))


def test_a_spare_that_is_damaged_costs_nothing(ring: bytes) -> None:
    _, size, count = PREFIX.unpack_from(ring)
    spare = PREFIX_SIZE + size * count
    check(ring, spare, len(ring), bytes(len(ring) - spare))
    check(ring, spare, len(ring), b"")
    check(ring, spare, spare + PREFIX_SIZE, bytes(PREFIX_SIZE))


def test_what_is_saved_has_a_spare_and_a_copy_on_a_disk_too(ring: bytes, tmp_path: Path) -> None:
    again = save(PATH, ring).content
    check(again, 0, MOST, bytes(MOST))
    path = tmp_path / "ring.recording"
    path.write_bytes(ring)
    with RingFile(path) as opened, Mirror(opened, tmp_path / "copy.recording") as mirror:
        mirror.sync()
    copy = whole_content_of(tmp_path / "copy.recording")
    assert copy == ring
    check(copy, 0, MOST, bytes(MOST))


def test_sections_of_the_lap_before_are_none_of_a_chunk_whose_beginning_is_lost(
    ring: bytes,
) -> None:
    sections = list(places(ring))
    middle = len(sections) // 2
    half, end = sections[middle][0], sections[-1][1]
    first = sections[0][0]
    lapped = ring[:first] + ring[half:end] + ring[first:half] + ring[end:]
    damaged = bytearray(lapped)
    damaged[PREFIX_SIZE : PREFIX_SIZE + CHUNK.size] = b"\xff" * CHUNK.size
    done = save(PATH, bytes(damaged))
    assert done.sections == len(sections) - middle


def test_a_replay_goes_on_from_each_chunk_of_a_whole_one_to_the_next(whole: bytes) -> None:
    (segment,) = recording_in(whole).segments()
    assert segment.contents == sections_of(whole)


def test_a_replay_goes_over_no_gap_behind_a_damaged_section(whole: bytes) -> None:
    *_, (last, _) = [place for place in places(whole) if place[0] < chunks_of(whole)[1]]
    damaged = bytearray(whole)
    damaged[last + SECTION.size] ^= 1
    recording = recording_in(bytes(damaged))
    first = recording.chunks[0]
    assert first.damage is not None
    segment, *_ = recording.segments()
    assert segment.contents == first.contents[1:]
