"""docs/raspberry-pi.md and the README's section: every command in them is one that there is."""

import re
import shlex
from pathlib import Path

import pytest

from firmware_runtime.board import registry
from firmware_runtime.cli.main import parser

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "raspberry-pi.md").read_text(encoding="utf-8")
README = (ROOT / "README.md").read_text(encoding="utf-8")
SECTION = README.partition("## On a Raspberry Pi\n")[2].partition("\n## ")[0]
COMMAND = re.compile(r"^    (?:sudo )?\S*firmware-runtime (.+)$", re.MULTILINE)
NEW_ADDRESS = re.compile(r"0xA0 0xAA 0xA5 (0x..);.* (0x..) 0 .*: (0x..)$", re.MULTILINE)


@pytest.mark.parametrize("line", [*COMMAND.findall(PAGE), *COMMAND.findall(SECTION)])
def test_a_command_of_the_page_is_taken(line: str) -> None:
    words = shlex.split(line, comments=True)
    assert callable(parser(words).parse_args(words).execute)


def test_new_addresses_of_the_page_are_those_of_the_board() -> None:
    devices = registry.load("detective").devices
    wanted = {device.address for device in devices if device.chip in {"SRF08", "CMPS12"}}
    given = NEW_ADDRESS.findall(PAGE)
    assert {int(address, 0) for _, _, address in given} == wanted
    assert all(int(byte, 0) == 2 * int(address, 0) for byte, _, address in given)


@pytest.mark.parametrize("board", ["detective", "tachobot"])
def test_the_page_names_every_chip_with_its_address(board: str) -> None:
    for device in registry.load(board).devices:
        assert device.chip in PAGE
        assert f"0x{device.address:02x}" in PAGE
