"""Switching off from another process: every chip that can be reached, whatever became of others."""

from collections.abc import Sequence
from pathlib import Path

import pytest

import boards.registry
from firmware_runtime.cli import lines
from firmware_runtime.cli.outputs import Outputs, switched_off
from firmware_runtime.hal.errors import BusAbsent
from firmware_runtime.hal.i2c import I2cBus, Message

TWO_BUSES = ("buses.other.device=/dev/i2c-7", "buses.other.speed_hz=400000", "esc.bus=other")


class NotedBus(I2cBus):
    """Notes who is written to."""

    def __init__(self, name: str, addresses: list[int]) -> None:
        self.name = name
        self._addresses = addresses

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        self._addresses.append(address)
        return bytes(sum(each for each in messages if isinstance(each, int)))


@pytest.mark.parametrize(("gone", "reached"), [("i2c1", 0x41), ("other", 0x40)])
def test_a_bus_that_is_gone_does_not_keep_the_other_from_being_switched_off(
    monkeypatch: pytest.MonkeyPatch, gone: str, reached: int
) -> None:
    addresses: list[int] = []

    def open_i2c(name: str, path: str, *, alone: bool) -> I2cBus:
        assert not alone
        if name == gone:
            raise BusAbsent(f"{name}: {path} does not exist")
        return NotedBus(name, addresses)

    monkeypatch.setattr(lines, "open_i2c", open_i2c)
    outputs = Outputs(boards.registry.load("tachobot", TWO_BUSES), None)
    (failed,) = outputs.make_safe()
    assert failed.startswith(f"{gone} 0x4")
    assert failed.endswith("does not exist")
    assert set(addresses) == {reached}


def test_a_run_that_drives_other_chips_cannot_be_switched_off_from_here(tmp_path: Path) -> None:
    doubles = tmp_path / "doubles.socket"
    outputs = Outputs(boards.registry.load("tachobot"), doubles)
    moved = boards.registry.load("tachobot", ["esc.address=0x42"])
    against = outputs.objection({"switched_off": switched_off(moved, doubles)})
    assert against is not None
    assert f"go off by {doubles} 0x40: fd10, {doubles} 0x42: fd10, here by" in against
    tuned = boards.registry.load("tachobot", ["controller.yaw.kp=0.5"])
    assert outputs.objection({"switched_off": switched_off(tuned, doubles)}) is None


def test_a_run_whose_bus_cannot_be_opened_is_out_of_reach() -> None:
    board = boards.registry.load("tachobot", ["buses.i2c1.device=/dev/i2c-none"])
    outputs = Outputs(board, None)
    with pytest.raises(BusAbsent, match="i2c1: /dev/i2c-none cannot be opened"):
        outputs.objection({"switched_off": switched_off(board, None)})


def test_settings_that_were_changed_since_the_guard_began_are_taken_up(tmp_path: Path) -> None:
    shipped = boards.registry.load("tachobot").source.read_text(encoding="utf-8")
    file = tmp_path / "board.toml"
    file.write_text(shipped, encoding="utf-8")
    doubles = tmp_path / "doubles.socket"
    outputs = Outputs(boards.registry.load(str(file)), doubles)
    file.write_text(shipped.replace("address = 0x41", "address = 0x42"), encoding="utf-8")
    run = {"switched_off": switched_off(boards.registry.load(str(file)), doubles)}
    assert outputs.objection(run) is None
    file.write_text("broken", encoding="utf-8")
    assert outputs.objection(run) is None, "what was taken up stays"


def test_doubles_that_nobody_serves_are_one_sentence(tmp_path: Path) -> None:
    outputs = Outputs(boards.registry.load("tachobot"), tmp_path / "doubles.socket")
    (failed,) = outputs.make_safe()
    assert "doubles.socket" in failed
