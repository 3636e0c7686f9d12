"""One damage of some KiB, wherever it is, costs a short run no section that it has not touched."""

import random
from collections.abc import Callable
from pathlib import Path

import pytest

from firmware_runtime.recording.blackbox.excerpts import Mirror
from firmware_runtime.recording.blackbox.layout import CHUNK, PREFIX, PREFIX_SIZE, SECTION
from firmware_runtime.recording.blackbox.ring_file import RingFile, whole_content_of
from firmware_runtime.recording.blackbox.salvage import save
from tests.support.recorded import record, recording_in

PATH = Path("damaged.recording")
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


def sections_of(content: bytes) -> list[tuple[int, int]]:
    """Begin and end of each section of the one chunk, its header left out."""
    found, place = [], PREFIX_SIZE + CHUNK.size
    end = PREFIX_SIZE + CHUNK.unpack_from(content, PREFIX_SIZE)[1]
    while place < end:
        after = place + SECTION.size + SECTION.unpack_from(content, place)[0]
        found.append((place, after))
        place = after
    return found[1:]


def check(ring: bytes, begin: int, end: int, content: bytes) -> None:
    """What is saved of the ring with that in place of these bytes is all that they have not hit."""
    damaged = ring[:begin] + content + ring[end:]
    expected = [
        ring[place + SECTION.size : after]
        for place, after in sections_of(ring)
        if after <= begin or place >= end or damaged[place:after] == ring[place:after]
    ]
    recording = recording_in(save(PATH, damaged).content)
    assert [each for chunk in recording.chunks for each in chunk.contents[1:]] == expected
    assert recording.header == recording_in(ring).header


@pytest.mark.slow
@pytest.mark.parametrize("damage", [noise, zeros, ones], ids=lambda each: each.__name__)
def test_what_lies_beyond_the_damage_is_saved(ring: bytes, damage: Damage) -> None:
    _, last = sections_of(ring)[-1]
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
    saved = save(PATH, ring).content
    check(saved, 0, MOST, bytes(MOST))
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
    sections = sections_of(ring)
    middle = len(sections) // 2
    half, end = sections[middle][0], sections[-1][1]
    first = sections[0][0]
    lapped = ring[:first] + ring[half:end] + ring[first:half] + ring[end:]
    damaged = bytearray(lapped)
    damaged[PREFIX_SIZE : PREFIX_SIZE + CHUNK.size] = b"\xff" * CHUNK.size
    done = save(PATH, bytes(damaged))
    assert done.sections == len(sections) - middle
