"""Files that are replaced at once: with the permissions stated, and through nothing of others'."""

import os
import tracemalloc
from collections.abc import Iterator
from pathlib import Path

import pytest

from firmware_runtime.statistics.paths import Companion
from firmware_runtime.statistics.takeovers import (
    Takeover,
    note_takeover,
    read_takeovers,
)
from firmware_runtime.system.atomic_file import (
    OWN_AND_GROUP,
    keep_file,
    read_file,
    replace_file,
)
from firmware_runtime.system.this_process import this_process


@pytest.fixture
def open_umask() -> Iterator[None]:
    before = os.umask(0)
    yield
    os.umask(before)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tachobot.guard"


def permissions(path: Path) -> int:
    return path.stat().st_mode & 0o777


@pytest.mark.usefixtures("open_umask")
def test_the_permissions_are_those_stated_whatever_the_umask(path: Path) -> None:
    replace_file(path, b"x", OWN_AND_GROUP)
    assert permissions(path) == 0o640
    os.umask(0o777)
    replace_file(path, b"y", OWN_AND_GROUP)
    assert permissions(path) == 0o640


def test_what_lies_where_it_is_made_is_neither_followed_nor_written_to(path: Path) -> None:
    planted = path.parent / f".{path.name}.{os.getpid()}"
    victim = path.parent / "victim"
    victim.write_text("whole")
    planted.symlink_to(victim)
    replace_file(path, b"x")
    assert (victim.read_text(), path.read_bytes()) == ("whole", b"x")
    assert not path.is_symlink()


def test_what_could_not_be_finished_is_removed(path: Path) -> None:
    path.mkdir()
    with pytest.raises(OSError, match="directory"):
        replace_file(path, b"x")
    assert [each.name for each in path.parent.iterdir()] == [path.name]


def test_a_fifo_is_not_waited_for(path: Path) -> None:
    os.mkfifo(path)
    with pytest.raises(OSError, match="no regular file"):
        read_file(path)


@pytest.mark.usefixtures("open_umask")
def test_a_place_that_a_user_named_is_replaced_only_if_it_is_a_file(path: Path) -> None:
    keep_file(path, b"one")
    keep_file(path, b"two")
    assert path.read_bytes() == b"two"
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(OSError, match="no regular file"):
        keep_file(path, b"three")
    assert path.is_fifo()


def test_a_link_that_a_user_named_stays_a_link(path: Path) -> None:
    path.symlink_to(path.with_name("target"))
    keep_file(path, b"one")
    assert path.is_symlink()
    assert path.with_name("target").read_bytes() == b"one"


def test_what_a_guard_notes_is_for_its_group_and_not_for_all_users(tmp_path: Path) -> None:
    statistics = tmp_path / "tachobot.stats"
    note_takeover(statistics, Takeover(1, this_process(), 1, "it hung"))
    assert permissions(Companion.TAKEOVERS.beside(statistics)) == 0o640


@pytest.mark.parametrize("content", [b"\xff\xfe\n", b"[" * 100_000, b'{"at_ns": 1e999}\n', b"\0"])
def test_no_content_keeps_a_guard_from_starting(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    assert read_takeovers(path.with_suffix(".stats")) == []


def test_a_fifo_in_its_place_keeps_a_guard_from_nothing(path: Path) -> None:
    os.mkfifo(path)
    assert read_takeovers(path.with_suffix(".stats")) == []


def test_a_small_file_takes_little_memory(tmp_path: Path) -> None:
    path = tmp_path / "board.toml"
    path.write_bytes(b"kept")
    tracemalloc.start()
    try:
        assert read_file(path) == b"kept"
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()
