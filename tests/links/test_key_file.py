"""Key files: made for their owner alone, and refused where they are not."""

import os
import stat
from pathlib import Path

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.key_file import KEY_BYTES, read_key, write_key


def key_of(path: Path, content: bytes, mode: int = 0o600) -> Path:
    path.write_bytes(content)
    path.chmod(mode)
    return path


def test_a_new_key_is_for_its_owner_alone_and_no_two_are_the_same(tmp_path: Path) -> None:
    one, other = tmp_path / "one.key", tmp_path / "other.key"
    for path in (one, other):
        write_key(path)
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
        assert len(read_key(path)) == KEY_BYTES
    assert read_key(one) != read_key(other)


def test_the_umask_takes_nothing_from_the_owner(tmp_path: Path) -> None:
    before = os.umask(0o777)
    try:
        write_key(tmp_path / "robot.key")
    finally:
        os.umask(before)
    assert len(read_key(tmp_path / "robot.key")) == KEY_BYTES


def test_no_key_is_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "robot.key"
    write_key(path)
    before = path.read_bytes()
    with pytest.raises(ConfigError, match="overwritten"):
        write_key(path)
    assert path.read_bytes() == before


@pytest.mark.parametrize("mode", [0o400, 0o600])
def test_a_key_that_only_its_owner_reads_is_taken(tmp_path: Path, mode: int) -> None:
    key = bytes(range(KEY_BYTES))
    assert read_key(key_of(tmp_path / "robot.key", key, mode)) == key


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o660, 0o644, 0o601, 0o620])
def test_a_key_that_is_open_to_others_is_refused(tmp_path: Path, mode: int) -> None:
    path = key_of(tmp_path / "robot.key", bytes(range(KEY_BYTES)), mode)
    with pytest.raises(ConfigError, match=f"mode {mode:04o}"):
        read_key(path)


@pytest.mark.parametrize(
    ("content", "found"),
    [
        (b"", "0 bytes"),
        (bytes(range(31)), "31 bytes"),
        (bytes(range(33)), "more than 32 bytes"),
        (bytes(32), "all bytes are the same"),
        (b"0123456789abcdef" * 4 + b"\n", "more than 32 bytes"),
    ],
)
def test_what_is_no_key_is_refused(tmp_path: Path, content: bytes, found: str) -> None:
    with pytest.raises(ConfigError, match=found):
        read_key(key_of(tmp_path / "robot.key", content))


def test_what_is_no_file_is_refused_without_waiting_for_it(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo", 0o600)
    for path in (tmp_path / "fifo", tmp_path, tmp_path / "nothing", Path("a\0b")):
        with pytest.raises(ConfigError):
            read_key(path)


def test_no_key_is_made_where_nothing_can_be(tmp_path: Path) -> None:
    for path in (tmp_path / "no folder" / "robot.key", Path("a\0b")):
        with pytest.raises(ConfigError):
            write_key(path)


def test_the_user_learns_which_option_named_the_key(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"^--link: .*nothing") as refused:
        read_key(tmp_path / "nothing", "--link")
    assert refused.value.where == "--link"
