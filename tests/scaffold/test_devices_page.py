"""docs/devices-of-your-own.md: its commands and test run as they stand, its tables are whole."""

import ast
import re
import shlex
import subprocess
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from firmware_drivers.actuator import Actuator

from firmware_runtime.board.registers.register_table import Register, RegisterTable
from tests.support.command import Command, started
from tests.support.pages import PROJECT
from tests.support.waiting import PATIENCE_S
from tests.support.written_package import WrittenPackage, as_installed

PAGE = (PROJECT / "docs" / "devices-of-your-own.md").read_text(encoding="utf-8")
_BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.DOTALL | re.MULTILINE)
SERVE = "doubles serve"
WINCH = PROJECT / "examples/underwater/underwater/winch"


def blocks(kind: str) -> list[str]:
    return [text for found, text in _BLOCK.findall(PAGE) if found == kind]


def command_lines() -> Iterator[list[str]]:
    for block in blocks("sh"):
        for line in block.splitlines():
            yield shlex.split(line)


def test_every_key_of_a_table_is_on_the_page() -> None:
    for schema in (RegisterTable, Register):
        for field in msgspec.structs.fields(schema):
            assert f"`{field.name}`" in PAGE or f"`[[{field.name}]]`" in PAGE, field.name


@pytest.mark.slow
@pytest.mark.real_time
def test_its_commands_run_as_they_stand(tmp_path: Path) -> None:
    package = WrittenPackage(tmp_path, tmp_path / "site")
    folder = tmp_path
    servers: list[subprocess.Popen[str]] = []
    try:
        for words in command_lines():
            if words[0] == "cd":
                folder = folder / words[1]
            elif words[:3] == ["python", "-m", "pip"]:
                package = as_installed(folder, tmp_path / "site")
            elif " ".join(words[1:3]) == SERVE:
                servers.append(served(package, words, folder))
            else:
                ended = run(package, words, folder)
                assert ended.returncode == 0, (words, ended.stdout, ended.stderr)
    finally:
        for server in servers:
            server.terminate()
            server.communicate(timeout=PATIENCE_S)
    assert (tmp_path / "lamp" / "lamp" / "driver.py").exists()
    assert len(servers) == 1


def run(
    package: WrittenPackage, words: list[str], folder: Path
) -> "subprocess.CompletedProcess[str]":
    if words[0] == "make":
        return package.python("-m", "pytest", "-q", "-p", "no:cacheprovider", cwd=folder)
    return package.command(*words[1:], cwd=folder)


def served(package: WrittenPackage, words: list[str], folder: Path) -> "subprocess.Popen[str]":
    environment = {**package.environment, "PYTHONUNBUFFERED": "1"}
    server = started(*words[1:], cwd=folder, env=environment)
    assert server.stdout is not None
    assert "serving" in server.stdout.readline()
    return server


@pytest.mark.slow
def test_its_test_is_green(tmp_path: Path) -> None:
    assert WrittenPackage(tmp_path, tmp_path).command("new", "chip", "light").returncode == 0
    package = as_installed(tmp_path / "light", tmp_path / "site")
    test = next(block for block in blocks("python") if "i2c_double" in block)
    (tmp_path / "light" / "tests" / "test_page.py").write_text(test)
    done = package.python("-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/test_page.py")
    assert done.returncode == 0, done.stdout
    assert "1 passed" in done.stdout


def test_the_page_names_all_that_an_actuator_asks_of_a_subclass() -> None:
    asked = [*Actuator.__abstractmethods__, "external", "resume", "poll"]
    for name in asked:
        assert f"| `{name}(" in PAGE, name


@pytest.mark.slow
def test_the_winch_of_the_example_is_what_its_table_makes(tmp_path: Path) -> None:
    words = ("new", "chip", "winch", "--registers", WINCH / "registers.toml")
    assert WrittenPackage(tmp_path, tmp_path).command(*words).returncode == 0
    written = (tmp_path / "winch/winch/driver.py").read_text(encoding="utf-8")
    kept = (WINCH / "driver.py").read_text(encoding="utf-8")
    assert ast.dump(ast.parse(kept)) == ast.dump(ast.parse(written))


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize(
    ("chip", "expected"), [("plumb", "water 15.00 degC"), ("brook", "flow 0.250 l/s")]
)
def test_a_sensor_of_the_example_is_tried_on_its_double(
    chip: str, expected: str, command: Command
) -> None:
    assert expected in command.said("try", chip, "--doubles", "--for", "0.1")
