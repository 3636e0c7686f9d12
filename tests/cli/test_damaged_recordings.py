"""Cut, damaged and foreign recordings: every verb gives a sentence, never a traceback."""

import os
import random
from collections.abc import Callable
from pathlib import Path

import pytest

from firmware_runtime.recording.blackbox import layout
from firmware_runtime.recording.blackbox.layout import CHUNK, MAGIC, PREFIX_SIZE
from tests.support.command import Command
from tests.support.recorded import in_chunks, record

SEEDS = range(4)
VERBS: dict[str, Callable[[Path, Path], list[object]]] = {
    "replay": lambda path, _: ["replay", path],
    "recordings": lambda path, _: ["recordings", "list", "--in", path.parent],
    "keep": lambda path, folder: ["recordings", "keep", path, "-o", folder / "kept"],
    "mcap": lambda path, folder: ["export", path, "-o", folder / "x.mcap"],
    "csv": lambda path, folder: ["export", path, "-o", folder / "x.csv"],
    "perfetto": lambda path, folder: ["export", path, "-o", folder / "x.json"],
    "recover": lambda path, folder: ["recordings", "recover", path, "-o", folder / "saved"],
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Some chunks of a few sections each."""
    path = tmp_path_factory.mktemp("recordings") / "whole.recording"
    return in_chunks(record(path, "detective", 0.1), 8)


def cut(content: bytes, chance: random.Random) -> bytes:
    return content[: chance.randrange(len(content))]


def flipped(content: bytes, chance: random.Random) -> bytes:
    damaged = bytearray(content)
    for _ in range(chance.choice([1, 1, 3, 100])):
        damaged[chance.randrange(len(damaged))] ^= 1 << chance.randrange(8)
    return bytes(damaged)


def beginning_flipped(content: bytes, chance: random.Random) -> bytes:
    damaged = bytearray(content)
    damaged[chance.randrange(PREFIX_SIZE + CHUNK.size)] ^= 1 << chance.randrange(8)
    return bytes(damaged)


def without_a_part(content: bytes, chance: random.Random) -> bytes:
    begin, end = sorted(chance.randrange(len(content)) for _ in range(2))
    return content[:begin] + content[end:]


def foreign(content: bytes, chance: random.Random) -> bytes:
    return content[: chance.choice([0, 8, 16, 64])] + chance.randbytes(chance.randrange(3000))


DAMAGES = [cut, flipped, beginning_flipped, without_a_part, foreign]


@pytest.mark.slow
@pytest.mark.parametrize("damage", DAMAGES, ids=lambda each: each.__name__)
@pytest.mark.parametrize("verb", VERBS)
def test_there_is_a_sentence(
    command: Command,
    tmp_path: Path,
    whole: bytes,
    verb: str,
    damage: Callable[[bytes, random.Random], bytes],
) -> None:
    path = tmp_path / "damaged" / "x.recording"
    path.parent.mkdir()
    for seed in SEEDS:
        path.write_bytes(damage(whole, random.Random(seed)))  # noqa: S311 -- repeatable, not secret
        ended = command(*VERBS[verb](path, tmp_path))
        assert ended.status in {0, 1, 2}, seed
        assert "Traceback" not in ended.error
        if ended.status == 2:
            assert ended.out == ""
            assert len(ended.error.splitlines()) == 1, ended.error


def made_pipe(path: Path) -> None:
    os.mkfifo(path)


def made_device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def made_folder(path: Path) -> None:
    path.mkdir()


def made_sparse(path: Path) -> None:
    """4 GiB of nothing."""
    path.touch()
    os.truncate(path, 1 << 32)


def made_closed_in_itself(path: Path) -> None:
    path.symlink_to(path)


STRANGE = [made_pipe, made_device, made_folder, made_sparse, made_closed_in_itself]
READERS: dict[str, Callable[[Path, Path], list[object]]] = {
    **VERBS,
    "debug": lambda path, _: ["debug", path, "--at", "0"],
    "doubles": lambda path, folder: ["doubles", "replay", path, "--socket", folder / "socket"],
}


@pytest.mark.parametrize("made", STRANGE, ids=lambda each: each.__name__)
@pytest.mark.parametrize("verb", sorted(READERS.keys() - {"recordings"}))
def test_what_is_no_file_of_a_recording_is_neither_waited_for_nor_read(
    command: Command, tmp_path: Path, verb: str, made: Callable[[Path], None]
) -> None:
    made(path := tmp_path / "x.recording")
    error = command.refused(*READERS[verb](path, tmp_path))
    assert str(path) in error.splitlines()[-1]
    assert "recording of a run" in error


def test_of_a_file_that_goes_on_for_4_gib_behind_a_recording_that_is_read(
    command: Command, tmp_path: Path, whole: bytes
) -> None:
    path = tmp_path / "x.recording"
    path.write_bytes(whole)
    os.truncate(path, 1 << 32)
    assert command("replay", path).status == 0
    ended = command("recordings", "recover", path, "-o", tmp_path / "saved.recording")
    assert ended.status == 0
    assert "lost: nothing" in ended.out


@pytest.fixture
def without_its_end(tmp_path: Path, whole: bytes) -> Path:
    """The bytes of the last two chunks are wrong, from their beginnings on."""
    _, size, chunks = layout.PREFIX.unpack_from(whole)
    damaged = bytearray(whole)
    for begin in range(layout.PREFIX_SIZE + (chunks - 2) * size, len(whole), size):
        damaged[begin + CHUNK.size : begin + CHUNK.size + 8] = b"\xff" * 8
    path = tmp_path / "x.recording"
    path.write_bytes(damaged)
    return path


def test_of_one_whose_last_chunks_are_lost_replay_names_the_damage(
    command: Command, without_its_end: Path
) -> None:
    ended = command("replay", without_its_end)
    assert ended.status == 1
    first, *_ = ended.out.splitlines()
    assert first.startswith("not whole: no section is whole of 2 chunks, the first at byte ")


@pytest.mark.parametrize("verb", [["replay", "--from"], ["debug", "--at"]])
def test_an_instant_that_is_lost_is_said_to_be_with_the_damage_and_what_can_be_done(
    command: Command, without_its_end: Path, verb: list[str]
) -> None:
    name, option = verb
    *_, said = command.refused(name, without_its_end, option, "0.099").splitlines()
    words = [
        str(without_its_end),
        "it ends at",
        "2 chunks, the first at byte",
        "recordings recover",
    ]
    assert [each for each in words if each not in said] == []
    assert "; expected an instant from 0 to 0.0" in said


def test_the_debugger_says_before_it_stops_and_at_the_end_what_is_damaged(
    command: Command, without_its_end: Path
) -> None:
    ended = command("debug", without_its_end, "--at", "0", "--until", "body_sonar.fault")
    assert ended.status == 6
    assert f"debug: {without_its_end} is not whole: no section is whole of 2" in ended.error
    assert "the recording ends here, and it is damaged (no section" in ended.out


def test_a_file_that_ends_before_its_last_chunks_is_not_whole(
    command: Command, tmp_path: Path, whole: bytes
) -> None:
    _, size, chunks = layout.PREFIX.unpack_from(whole)
    path = tmp_path / "x.recording"
    path.write_bytes(whole[: layout.PREFIX_SIZE + 2 * size])
    ended = command("replay", path)
    assert ended.status == 1
    said = f"not whole: the file ends after {path.stat().st_size} bytes, 2 of {chunks} chunks"
    assert ended.out.splitlines()[0] == said


@pytest.mark.parametrize("left", [CHUNK.size, CHUNK.size + 1])
def test_a_file_that_ends_as_its_last_chunk_begins_is_not_whole(
    command: Command, tmp_path: Path, whole: bytes, left: int
) -> None:
    _, size, chunks = layout.PREFIX.unpack_from(whole)
    path = tmp_path / "x.recording"
    path.write_bytes(whole[: layout.PREFIX_SIZE + (chunks - 1) * size + left])
    ended = command("replay", path)
    assert ended.status == 1
    assert ended.out.startswith("not whole: ")


@pytest.mark.parametrize("verb", ["replay", "debug", "mcap"])
def test_a_recording_of_another_format_is_named_as_one(
    command: Command, tmp_path: Path, whole: bytes, verb: str
) -> None:
    path = tmp_path / "x.recording"
    path.write_bytes(MAGIC[:-1] + b"1" + whole[len(MAGIC) :])
    assert "another format" in command.refused(*READERS[verb](path, tmp_path))


def test_nothing_is_recovered_of_a_whole_recording_of_another_format(
    command: Command,
    tmp_path: Path,
    whole: bytes,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(layout, "MAGIC", MAGIC[:-1] + b"1")
    path, output = tmp_path / "x.recording", tmp_path / "saved.recording"
    _, size, chunks = layout.PREFIX.unpack_from(whole)
    path.write_bytes(layout.prefix(size, chunks) + whole[layout.PREFIX_SIZE :])
    monkeypatch.undo()
    ended = command("recordings", "recover", str(path), "-o", str(output))
    assert (ended.status, ended.out, output.exists()) == (2, "", False)
    assert "another format" in ended.error
