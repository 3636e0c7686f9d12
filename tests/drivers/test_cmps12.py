import math
from typing import TypeAlias

import pytest
from firmware_drivers.chips.bearing import in_circle
from firmware_drivers.chips.cmps12 import Cmps12

from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import (
    Implausible,
    NoAcknowledge,
    NotReady,
    Stuck,
    WrongDevice,
)

Wire: TypeAlias = list[tuple[int, tuple[Message, ...]]]
Registers: TypeAlias = dict[int, bytearray]
COMPASS = 0x61


@pytest.fixture
def registers() -> Registers:
    return {COMPASS: bytearray(256)}


@pytest.fixture
def chip(register_bus: I2cBus, registers: Registers) -> Cmps12:
    point(registers, 0)
    return Cmps12(register_bus, COMPASS)


def point(registers: Registers, tenths: int, *, coarse: int | None = None) -> None:
    if coarse is None:
        coarse = tenths * 256 // 3600
    registers[COMPASS][0:4] = bytes((7, coarse, *tenths.to_bytes(2, "big")))


@pytest.mark.parametrize(
    ("tenths", "bearing_deg"), [(0, 0.0), (1, 0.1), (900, 90.0), (2565, 256.5), (3599, 359.9)]
)
def test_the_bearing_is_given_in_degrees_to_a_tenth(
    chip: Cmps12, registers: Registers, tenths: int, bearing_deg: float
) -> None:
    point(registers, tenths)
    assert chip.read_bearing().bearing_deg == pytest.approx(bearing_deg, abs=1e-12)


def test_a_reading_is_two_short_transactions_and_writes_nothing(chip: Cmps12, wire: Wire) -> None:
    chip.read_bearing()
    assert wire == [(COMPASS, (b"\x00", 12)), (COMPASS, (b"\x1e", 1))]


@pytest.mark.parametrize(("state", "calibration"), [(0x00, 0), (0xFC, 0), (0x32, 2), (0xFF, 3)])
def test_the_calibration_of_the_magnetometer_comes_with_it(
    chip: Cmps12, registers: Registers, state: int, calibration: int
) -> None:
    registers[COMPASS][0x1E] = state
    assert chip.read_bearing().calibration == calibration


def test_a_bearing_whose_two_forms_differ_is_none(chip: Cmps12, registers: Registers) -> None:
    point(registers, 1800, coarse=64)
    with pytest.raises(Implausible) as caught:
        chip.read_bearing()
    assert (caught.value.axis, caught.value.value) == ("bearing", 180.0)


def test_a_field_that_stands_still_is_no_bearing_until_a_bit_changes(
    chip: Cmps12, registers: Registers
) -> None:
    for _ in range(100):
        chip.read_bearing()
    with pytest.raises(Stuck) as caught:
        list(map(Cmps12.read_bearing, [chip] * 100))
    assert caught.value.axis == "field x, field y, field z"
    assert 100 < caught.value.readings < 200
    registers[COMPASS][6:12] = bytes((1, 2, 3, 4, 5, 6))
    chip.read_bearing()


@pytest.mark.parametrize("tenths", [3600, 0xE2E4, 0xFFFF])
def test_a_bearing_beyond_the_circle_is_none(
    chip: Cmps12, registers: Registers, tenths: int
) -> None:
    point(registers, tenths, coarse=0)
    with pytest.raises(NotReady, match=f"bearing reads {tenths}; expected 0 to 3599"):
        chip.read_bearing()


@pytest.mark.parametrize("byte", [0x00, 0xFF])
def test_a_line_that_is_held_or_free_is_not_a_bearing(
    chip: Cmps12, registers: Registers, byte: int
) -> None:
    registers[COMPASS][:] = bytes((byte,)) * 256
    with pytest.raises(NotReady, match=f"software version reads {byte:02x}, expected 01 to fe"):
        chip.read_bearing()


@pytest.mark.parametrize("tenths", range(0, 3600, 97))
@pytest.mark.parametrize("steps", [255, 256])
def test_both_ways_to_divide_the_circle_into_a_byte_are_taken(
    chip: Cmps12, registers: Registers, tenths: int, steps: int
) -> None:
    for coarse in {tenths * steps // 3600, min(255, round(tenths * steps / 3600))}:
        point(registers, tenths, coarse=coarse)
        chip.identify()
        assert chip.read_bearing().bearing_deg == tenths / 10


def test_bearings_that_differ_across_north_are_close(chip: Cmps12, registers: Registers) -> None:
    for tenths, coarse in ((3599, 0), (0, 255)):
        point(registers, tenths, coarse=coarse)
        chip.identify()
        assert chip.read_bearing().bearing_deg == tenths / 10


@pytest.mark.parametrize(
    "found",
    [
        pytest.param(b"\x11\x04\xe2\xe4", id="a PCA9685 on a motor board"),
        pytest.param(b"\xff\xff\xff\xff", id="nothing drives the bus"),
        pytest.param(b"\x00\x00\x00\x00", id="a line is held"),
        pytest.param(b"\x07\x80\x00\x00", id="the bearings differ"),
    ],
)
def test_what_is_no_compass_is_refused(chip: Cmps12, registers: Registers, found: bytes) -> None:
    registers[COMPASS][0:4] = found
    with pytest.raises(WrongDevice, match=f"registers 0 to 3 read {found.hex(' ')}, expected"):
        chip.identify()


def test_an_absent_chip_says_what_was_expected(chip: Cmps12, registers: Registers) -> None:
    registers.clear()
    (step,) = chip.bring_up()
    with pytest.raises(NoAcknowledge, match="CMPS12 at 0x61 on i2c-1: no answer; expected a soft"):
        step.action()


@pytest.mark.parametrize(
    ("angle_deg", "expected"),
    [(0.0, 0.0), (360.0, 0.0), (-90.0, 270.0), (725.0, 5.0), (-1e-20, 0.0)],
)
def test_an_angle_is_brought_into_the_circle(angle_deg: float, expected: float) -> None:
    assert in_circle(angle_deg) == expected
    assert not math.isclose(in_circle(angle_deg), 360.0)
