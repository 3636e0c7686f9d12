import struct
from typing import TypeAlias

import pytest
from firmware_drivers.chips.ak8963 import Ak8963

from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady, WrongDevice

Wire: TypeAlias = list[tuple[int, tuple[Message, ...]]]
Registers: TypeAlias = dict[int, bytearray]


@pytest.fixture
def registers() -> Registers:
    memory = bytearray(256)
    memory[0x00] = 0x48
    memory[0x10:0x13] = bytes((176, 128, 0))
    return {0x0C: memory}


@pytest.fixture
def chip(register_bus: I2cBus) -> Ak8963:
    return Ak8963(register_bus)


def bring_up(chip: Ak8963) -> None:
    for step in chip.bring_up():
        step.action()


def test_modes_change_by_way_of_power_down_with_a_wait(chip: Ak8963, wire: Wire) -> None:
    waits = {}
    for step in chip.bring_up():
        wire.clear()
        step.action()
        for _, messages in wire:
            if len(messages) == 1:
                waits[messages[0]] = step.wait_ns
    assert list(waits) == [b"\x0b\x01", b"\x0a\x0f", b"\x0a\x00", b"\x0a\x16"]
    assert all(wait >= 100_000 for wait in waits.values())
    assert waits[b"\x0a\x16"] >= 9_000_000


def test_sensitivity_is_read_in_fuse_rom_mode_and_halved_to_doubled_by_it(
    chip: Ak8963, wire: Wire
) -> None:
    bring_up(chip)
    fuse, power_down = (wire.index((0x0C, (sent,))) for sent in (b"\x0a\x0f", b"\x0a\x00"))
    assert fuse < wire.index((0x0C, (b"\x10", 3))) < power_down
    assert chip.sensitivity == pytest.approx((0.15e-6 * 1.1875, 0.15e-6, 0.075e-6))


@pytest.mark.parametrize("fuse", [b"\x00\x00\x00", b"\xff\xff\xff"])
def test_a_fuse_rom_that_reads_one_level_is_a_fault(
    chip: Ak8963, registers: Registers, fuse: bytes
) -> None:
    registers[0x0C][0x10:0x13] = fuse
    with pytest.raises(NotReady, match=rf"fuse ROM reads {fuse.hex(' ')}; expected three factors"):
        bring_up(chip)


def test_another_identity_is_refused(chip: Ak8963, registers: Registers) -> None:
    registers[0x0C][0x00] = 0x49
    with pytest.raises(WrongDevice, match="AK8963 at 0x0c on i2c-1: WIA reads 49; expected 48"):
        bring_up(chip)


def test_no_answer_hints_at_bypass(chip: Ak8963, registers: Registers) -> None:
    registers.clear()
    with pytest.raises(NoAcknowledge, match=r"AK8963 at 0x0c on i2c-1: no answer.*bypass"):
        bring_up(chip)


def test_a_mode_that_did_not_take_is_reported(chip: Ak8963, registers: Registers) -> None:
    bring_up(chip)
    chip.verify()
    registers[0x0C][0x0A] = 0x00
    with pytest.raises(NotReady, match="CNTL1 reads 00; expected 16"):
        chip.verify()


def test_a_measurement_is_read_to_st2_and_given_in_tesla(
    chip: Ak8963, registers: Registers, wire: Wire
) -> None:
    bring_up(chip)
    registers[0x0C][0x02:0x0A] = struct.pack("<B3hB", 0x01, 400, -32760, 3, 0x10)
    assert chip.read_field() == pytest.approx((71.25e-6, -4914e-6, 0.225e-6))
    assert wire[-1] == (0x0C, (b"\x02", 8))


@pytest.mark.parametrize(
    ("st1", "st2", "reason"),
    [
        (0x00, 0x10, "no new measurement; expected 100 a second"),
        (0x01, 0x18, "ST2 reads 18; expected 10"),
        (0x01, 0x00, "ST2 reads 00; expected 10"),
    ],
)
def test_a_measurement_that_is_old_or_invalid_is_not_given(
    chip: Ak8963, registers: Registers, st1: int, st2: int, reason: str
) -> None:
    bring_up(chip)
    registers[0x0C][0x02:0x0A] = struct.pack("<B3hB", st1, 1, 2, 3, st2)
    with pytest.raises(NotReady, match=reason):
        chip.read_field()
