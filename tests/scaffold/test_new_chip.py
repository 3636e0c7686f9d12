"""`firmware-runtime new chip`: what it writes, that it works as written, and what it refuses."""

from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.errors import ConfigError
from firmware_runtime.host.scaffold.chip import write_chip
from tests.support.table_chip import ABOVE_FLAGS, EIGHT_BITS, WORDS
from tests.support.written_package import as_installed


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
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", "chip", "light", "--into", str(tmp_path / "light")]) == 0
    files, _, commands = capsys.readouterr().out.partition("next:\n")
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
    tests = package.python("-m", "pytest", "-q", "-p", "no:cacheprovider")
    assert tests.returncode == 1
    assert "registers_read_as_the_table_says_after_power_up" in tests.stdout
