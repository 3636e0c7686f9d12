"""A temporary folder goes with its process; that of one that was killed, when the next is made."""

import os
import tempfile
from pathlib import Path

import pytest

from firmware_runtime.system.own_folder import own_folder


@pytest.fixture(autouse=True)
def folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_it_goes_with_its_block(folders: Path) -> None:
    with own_folder() as first, own_folder() as second:
        (first / "key").touch()
        assert first != second
        assert first.is_dir(), "of a process that runs"
        assert first.stat().st_mode & 0o777 == 0o700
    assert list(folders.iterdir()) == []


def test_what_a_process_left_behind_is_removed(folders: Path) -> None:
    left = folders / "firmware-runtime-1-1-abc"
    left.mkdir()
    (left / "key").touch()
    with own_folder() as own:
        assert list(folders.iterdir()) == [own]


def test_what_a_process_has_stays_whose_start_it_did_not_know(folders: Path) -> None:
    other = folders / f"firmware-runtime-{os.getpid()}-0-abc"
    other.mkdir()
    with own_folder():
        pass
    assert list(folders.iterdir()) == [other]


def test_what_has_no_owner_stays(folders: Path) -> None:
    others = {folders / name for name in ("firmware-runtime-0", "firmware-runtime-1-1", "other")}
    for each in others:
        each.mkdir()
    link, file = folders / "firmware-runtime-1-1-link", folders / "firmware-runtime-1-1-file"
    link.symlink_to(folders / "other")
    file.touch()
    with own_folder():
        pass
    assert set(folders.iterdir()) == {*others, link, file}
