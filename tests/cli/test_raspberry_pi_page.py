"""docs/raspberry-pi.md names the chips of the robots, with their addresses."""

import re
from pathlib import Path

import pytest

from firmware_runtime.board import registry

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "raspberry-pi.md").read_text(encoding="utf-8")
NEW_ADDRESS = re.compile(r"0xA0 0xAA 0xA5 (0x..);.* (0x..) 0 .*: (0x..)$", re.MULTILINE)


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
