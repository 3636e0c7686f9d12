"""`new chip` and `new robot`: what they write, that it works as written, and what they refuse."""

import re
import shlex
from pathlib import Path

import pytest
from msgspec import Struct

from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.robot import Robot
from firmware_runtime.cli.main import main
from firmware_runtime.errors import ConfigError
from firmware_runtime.host.scaffold.chip import write_chip
from firmware_runtime.host.scaffold.package import class_name, write_robot
from tests.support.command import Command
from tests.support.table_chip import ABOVE_FLAGS, EIGHT_BITS, WORDS
from tests.support.written_package import WrittenPackage, as_installed


@pytest.mark.parametrize("name", ["", "Light", "light-sensor", "class", "json", "pca9685"])
def test_a_name_that_a_chip_cannot_have_is_refused_and_nothing_is_written(
    name: str, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError):
        write_chip(name, tmp_path / "new", None)
    assert list(tmp_path.iterdir()) == []


def test_a_faulty_table_is_refused_with_all_faults_and_nothing_is_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "x.toml"
    file.write_text(EIGHT_BITS.replace("0x5A", "0x5AA").replace('"w"', '"z"'))
    into = tmp_path / "new"
    words = ["new", "chip", "light", "--registers", str(file), "--into", str(into)]
    assert main(words) == 2
    error = capsys.readouterr().err
    assert "registers[4].access" in error
    file.write_text(EIGHT_BITS.replace("0x5A", "0x5AA").replace("0x04", "0x02"))
    assert main(words) == 2
    error = capsys.readouterr().err
    assert "2 faults" in error
    assert str(file) in error
    assert "registers[0].reset" in error
    assert "registers[3].address" in error
    assert not into.exists()


def test_the_command_prints_what_it_wrote_and_the_next_three_commands(
    tmp_path: Path, command: Command
) -> None:
    files, _, commands = command.said(
        "new", "chip", "light", "--into", tmp_path / "light"
    ).partition("next:\n")
    assert len(files.splitlines()) == len([p for p in tmp_path.rglob("*") if p.is_file()])
    assert len(commands.splitlines()) == 3


def test_every_word_of_the_template_is_replaced(tmp_path: Path) -> None:
    for path in write_chip("light", tmp_path / "light", None):
        text = f"{path.relative_to(tmp_path)} {path.read_text()}"
        assert "chipname" not in text.lower()
        assert not [word for word in ("CHIP_", "_ROWS", "REGISTER_", "QUANTITY_") if word in text]


def test_the_table_is_kept_as_its_author_wrote_it(tmp_path: Path) -> None:
    file = tmp_path / "x.toml"
    file.write_text(f"# chipname, ChipName and CHIP_TITLE stay\n{WORDS}")
    write_chip("words", tmp_path / "words", file)
    assert (tmp_path / "words" / "words" / "registers.toml").read_text() == file.read_text()


@pytest.mark.slow
@pytest.mark.parametrize(
    "text",
    [None, EIGHT_BITS, WORDS, ABOVE_FLAGS],
    ids=["example", "8 bits", "16 bits", "above flags"],
)
def test_its_own_tests_are_green_its_types_hold_and_it_is_tidy(
    text: str | None, tmp_path: Path, types_seen: Path
) -> None:
    registers = None
    if text is not None:
        registers = tmp_path / "x.toml"
        registers.write_text(text)
    write_chip("light", tmp_path / "light", registers)
    package = as_installed(tmp_path / "light", tmp_path / "site")
    tests = package.python("-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert tests.returncode == 0, tests.stdout
    types = package.types(types_seen, "light", "tests")
    assert types.returncode == 0, types.stdout
    ruff = ("-m", "ruff", "check", "--isolated", "--no-cache", "--select", "E,F,W,I,UP")
    tidy = package.python(*ruff, "--line-length", "100", ".")
    assert tidy.returncode == 0, tidy.stdout


@pytest.mark.slow
def test_the_command_line_knows_the_chip_once_it_is_installed(tmp_path: Path) -> None:
    write_chip("light", tmp_path / "light", None)
    package = as_installed(tmp_path / "light", tmp_path / "site")
    tried = package.command("try", "light", "--doubles", "--for", "0.01")
    assert tried.returncode == 0, tried.stderr
    assert "light" in tried.stdout
    assert "lx" in tried.stdout
    refused = package.command("doubles", "serve", "--usbip", "--chip", "light@0x10")
    assert refused.returncode == 2
    assert "expected 0x29, 0x39" in refused.stderr


@pytest.mark.slow
def test_a_driver_that_strays_from_its_table_turns_its_tests_red(tmp_path: Path) -> None:
    write_chip("light", tmp_path / "light", None)
    driver = tmp_path / "light" / "light" / "driver.py"
    driver.write_text(driver.read_text().replace('"LIGHT", 0x04', '"LIGHT", 0x06'))
    package = as_installed(tmp_path / "light", tmp_path / "site")
    tests = package.python("-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", "registers_read")
    assert tests.returncode == 1
    assert "registers_read_as_the_table_says_after_power_up" in tests.stdout


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


def test_the_command_prints_what_it_wrote_for_a_robot_and_what_is_next(
    tmp_path: Path, command: Command
) -> None:
    files, _, commands = command.said(
        "new", "robot", "rover", "--into", tmp_path / "a b"
    ).partition("next:\n")
    assert len(files.splitlines()) == len([p for p in tmp_path.rglob("*") if p.is_file()])
    assert len(commands.splitlines()) == 3
    assert f"cd '{tmp_path / 'a b'}'" in commands


@pytest.mark.slow
def test_its_own_tests_are_green_and_its_types_hold(tmp_path: Path, types_seen: Path) -> None:
    write_robot("rover", tmp_path / "rover")
    package = as_installed(tmp_path / "rover", tmp_path / "site")
    tests = package.python("-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert tests.returncode == 0, tests.stdout
    types = package.types(types_seen, "rover", "tests")
    assert types.returncode == 0, types.stdout


PAGE = Path(__file__).parents[2] / "docs/robot-of-your-own.md"
TEXT = PAGE.read_text(encoding="utf-8")
COMMANDS = [
    shlex.split(line)[1:]
    for block in re.findall(r"```sh\n(.*?)```", TEXT, re.DOTALL)
    for line in block.splitlines()
    if line.startswith("firmware-runtime ")
]


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_every_command_of_the_page_does_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    folder = tmp_path / "rover"
    package = WrittenPackage(folder, tmp_path / "site")
    for words in COMMANDS:
        if words[0] == "new":
            ended = package.command(*words, cwd=tmp_path)
            as_installed(folder, package.site)
            settings = (folder / "rover/board.toml").read_text()
            (folder / "left.toml").write_text(f'name = "left"\n{settings}')
        else:
            ended = package.command(*words)
        assert ended.returncode == 0, (words, ended.stderr)
    units = folder / "image/etc/systemd/system"
    for name in ("rover", "left"):
        assert (units / f"firmware-runtime@{name}.service.d/board.conf").is_file()


@pytest.mark.parametrize("contract", [BoardDefinition, Robot])
def test_the_page_names_every_field_of_the_contract(contract: type[Struct]) -> None:
    for field in contract.__struct_fields__:
        assert re.search(rf"`{field}[`(]", TEXT), field
