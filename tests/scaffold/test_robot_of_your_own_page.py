"""docs/robot-of-your-own.md: its commands, run as they stand there on a robot that was written."""

import re
import shlex
from pathlib import Path

import pytest
from msgspec import Struct

from firmware_runtime.board.definition import BoardDefinition
from firmware_runtime.board.robot import Robot
from tests.support.written_package import WrittenPackage, as_installed

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
