"""`firmware-runtime new robot`: what it writes, and what it refuses."""

import re
from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.errors import ConfigError
from firmware_runtime.host.scaffold.package import class_name, write_robot
from tests.support.written_package import as_installed


@pytest.mark.parametrize(
    "name",
    [
        *("", "Rover", "2wheels", "two-wheels", "_rover", "röver", "a/b", "../up", "a" * 33),
        *("class", "match", "tests", "numpy", "json", "drivers", "tachobot", "rover.py"),
    ],
)
def test_a_name_that_a_package_cannot_have_is_refused_and_nothing_is_written(
    name: str, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError):
        write_robot(name, tmp_path / "new")
    assert list(tmp_path.iterdir()) == []


def test_a_class_is_called_as_the_package_is() -> None:
    assert class_name("rover") == "Rover"
    assert class_name("two_wheels2") == "TwoWheels2"


def test_a_folder_with_something_in_it_is_refused_and_left_as_it_was(tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    kept.write_text("kept")
    for folder in (tmp_path, kept):
        with pytest.raises(ConfigError):
            write_robot("rover", folder)
    assert list(tmp_path.iterdir()) == [kept]
    assert kept.read_text() == "kept"


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ConfigError):
        write_robot("rover", tmp_path / "file" / "rover")


def test_words_are_replaced_in_names_and_texts_and_an_empty_folder_is_taken(tmp_path: Path) -> None:
    written = write_robot("two_wheels", tmp_path)
    assert sorted(path for path in tmp_path.rglob("*") if path.is_file()) == sorted(written)
    assert tmp_path / "two_wheels" / "board.toml" in written
    for path in written:
        text = f"{path.relative_to(tmp_path)} {path.read_text()}"
        assert re.search("pan.?tilt", text, re.IGNORECASE) is None


def test_the_command_prints_what_it_wrote_and_the_next_three_commands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", "robot", "rover", "--into", str(tmp_path / "a b")]) == 0
    files, _, commands = capsys.readouterr().out.partition("next:\n")
    assert len(files.splitlines()) == len([p for p in tmp_path.rglob("*") if p.is_file()])
    assert len(commands.splitlines()) == 3
    assert f"cd '{tmp_path / 'a b'}'" in commands


def test_bad_input_is_a_sentence_and_status_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "robot", "numpy"]) == 2
    assert "numpy" in capsys.readouterr().err


@pytest.mark.slow
def test_its_own_tests_are_green_and_its_types_hold(tmp_path: Path, types_seen: Path) -> None:
    write_robot("rover", tmp_path / "rover")
    package = as_installed(tmp_path / "rover", tmp_path / "site")
    tests = package.python("-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert tests.returncode == 0, tests.stdout
    types = package.types(types_seen, "rover", "tests")
    assert types.returncode == 0, types.stdout
