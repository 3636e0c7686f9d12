"""Whether a file can be written, found without making it."""

import os
from pathlib import Path

import pytest

from firmware_runtime.system.atomic_file import why_not_writable


def test_a_file_that_is_there_or_can_be_made_is_fine_and_is_not_touched(tmp_path: Path) -> None:
    there, new = tmp_path / "there", tmp_path / "new"
    there.write_text("kept")
    (link := tmp_path / "link").symlink_to(tmp_path / "to-be")
    assert [why_not_writable(each) for each in (there, new, link)] == [None, None, None]
    assert there.read_text() == "kept"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["link", "there"]


def test_what_cannot_be_opened_says_why(tmp_path: Path) -> None:
    (file := tmp_path / "file").touch()
    (astray := tmp_path / "astray").symlink_to(tmp_path / "no" / "x")
    assert why_not_writable(tmp_path) == "it is a folder"
    assert why_not_writable(tmp_path / "no" / "x") == f"there is no folder {tmp_path / 'no'}"
    assert why_not_writable(astray) == f"there is no folder {tmp_path / 'no'}"
    assert why_not_writable(file / "x") == "Not a directory"
    assert why_not_writable(tmp_path / ("x" * 300)) == "File name too long"
    assert why_not_writable(Path("a\0b")) == "a null character in its name"


def test_without_the_right_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (file := tmp_path / "file").touch()
    monkeypatch.setattr(os, "access", lambda *_: False)
    assert why_not_writable(file) == "no right to write it"
    assert why_not_writable(tmp_path / "new") == f"no right to write into {tmp_path}"
