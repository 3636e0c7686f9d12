"""The copy with other gains: nothing else changes, and nothing that is in force is written over."""

import os
from pathlib import Path

import pytest

from firmware_runtime.board.board_file import changed, write_copy
from firmware_runtime.board.installed import shipped_file
from firmware_runtime.board.local_settings import PLACE
from firmware_runtime.board.registry import load
from firmware_runtime.errors import ConfigError

VALUES = {"controller.yaw.kp": 2.5, "controller.yaw.kd": 1.25}


def test_only_the_gains_differ_and_every_comment_stays(tmp_path: Path) -> None:
    board, copy = load("tachobot"), tmp_path / "tuned.toml"
    write_copy(board, VALUES, copy)
    before = shipped_file("tachobot").read_text().splitlines()
    after = copy.read_text().splitlines()
    differ = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    assert differ == [("kp = 0.75", "kp = 2.5"), ("kd = 0.55", "kd = 1.25")]
    assert load(str(copy)).settings.controller.yaw.kp == 2.5


def test_comments_behind_a_value_dotted_keys_and_keys_left_out_are_seen_to() -> None:
    text = "a.kp = 1.0  # so\n[b]\nki = 2\n\n[b.c]\nkd=3#x\n"
    found = changed(text, {"a.kp": 9.5, "b.kp": 0.5, "b.c.kd": 1.5, "d.ki": 0.25})
    expected = "a.kp = 9.5  # so\n[b]\nkp = 0.5\nki = 2\n\n[b.c]\nkd=1.5#x\n\n[d]\nki = 0.25\n"
    assert found == expected


def test_a_file_whose_gains_are_in_a_table_on_one_line_is_refused() -> None:
    with pytest.raises(ConfigError, match="expected a table for each"):
        changed("a = {b = {kp = 1.0}}\n", {"a.b.kp": 2.0})


@pytest.mark.parametrize("way", ["itself", "symbolic link", "hard link", "folder's link"])
def test_the_boards_own_file_is_never_written_over(way: str, tmp_path: Path) -> None:
    own = tmp_path / "own" / "board.toml"
    own.parent.mkdir()
    own.write_bytes(shipped_file("tachobot").read_bytes())
    board, output = load(str(own)), tmp_path / "other.toml"
    if way == "itself":
        output = own
    elif way == "symbolic link":
        output.symlink_to(own)
    elif way == "hard link":
        os.link(own, output)
    else:
        (tmp_path / "link").symlink_to(own.parent)
        output = tmp_path / "link" / "board.toml"
    with pytest.raises(ConfigError, match="of tachobot itself"):
        write_copy(board, VALUES, output)
    assert own.read_bytes() == shipped_file("tachobot").read_bytes()


def test_shipped_files_and_settings_in_force_are_never_written_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_force = tmp_path / "in_force"
    in_force.mkdir()
    monkeypatch.setenv(PLACE, str(in_force))
    board = load("tachobot")
    shipped = tmp_path / "shipped.toml"
    shipped.symlink_to(shipped_file("detective"))
    with pytest.raises(ConfigError, match="shipped for detective"):
        write_copy(board, VALUES, shipped)
    (tmp_path / "link").symlink_to(in_force)
    for folder in (in_force, tmp_path / "link"):
        with pytest.raises(ConfigError, match="settings in force"):
            write_copy(board, VALUES, folder / "tachobot.toml")
    assert list(in_force.iterdir()) == []


def test_a_folder_and_a_place_that_takes_no_file_are_refused(tmp_path: Path) -> None:
    for output in (tmp_path, tmp_path / "nowhere" / "board.toml"):
        with pytest.raises(ConfigError, match="expected a name in a folder"):
            write_copy(load("tachobot"), VALUES, output)


def test_truth_values_and_texts_are_written_as_toml_has_them() -> None:
    text = 'on = true  # so\nname = "a # b"  # and so\n'
    found = changed(text, {"on": False, "name": 'c "d"'})
    assert found == 'on = false  # so\nname = "c \\"d\\""  # and so\n'
