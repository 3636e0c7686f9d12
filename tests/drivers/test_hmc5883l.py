import math
import struct
from typing import TypeAlias

import pytest
from firmware_drivers.chips.hmc5883l import Hmc5883l, Hmc5883lSettings

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady, Stuck, WrongDevice

Wire: TypeAlias = list[tuple[int, tuple[Message, ...]]]
Registers: TypeAlias = dict[int, bytearray]
CHIP = 0x1E
IDLE = 0x02


@pytest.fixture
def registers() -> Registers:
    memory = bytearray(256)
    memory[0x0A:0x0D] = b"H43"
    return {CHIP: memory}


@pytest.fixture
def chip(register_bus: I2cBus, registers: Registers) -> Hmc5883l:
    chip = Hmc5883l(register_bus)
    bring_up(chip, registers)
    return chip


def bring_up(chip: Hmc5883l, registers: Registers) -> None:
    for step in chip.bring_up():
        step.action()
        registers[CHIP][0x02] = IDLE


def measure(
    chip: Hmc5883l, registers: Registers, x: int, y: int, z: int, *, mode: int = IDLE
) -> None:
    (step,) = chip.measurement
    step.action()
    registers[CHIP][0x02] = mode
    registers[CHIP][0x03:0x09] = struct.pack(">3h", x, z, y)


# Bring-up -----------------------------------------------------------------------------------------


def test_bring_up_sets_range_and_throws_the_first_measurement_away(
    register_bus: I2cBus, registers: Registers, wire: Wire
) -> None:
    chip = Hmc5883l(register_bus, Hmc5883lSettings(range_gauss=4.0))
    bring_up(chip, registers)
    assert wire == [
        (CHIP, (b"\x0a", 3)),
        (CHIP, (b"\x00\x70\x80",)),
        (CHIP, (b"\x02\x01",)),
        (CHIP, (b"\x00", 9)),
    ]
    with pytest.raises(NotReady, match="no measurement to read"):
        chip.read_field()


def test_a_measurement_has_six_milliseconds_and_some_room(chip: Hmc5883l) -> None:
    (step,) = chip.measurement
    assert 6_000_000 < step.wait_ns <= 10_000_000
    assert [each.wait_ns for each in chip.bring_up() if each.wait_ns] == [step.wait_ns]


def test_an_overflow_in_the_measurement_thrown_away_does_no_harm(
    register_bus: I2cBus, registers: Registers
) -> None:
    registers[CHIP][0x03:0x05] = b"\xf0\x00"
    bring_up(Hmc5883l(register_bus), registers)


def test_another_identity_is_refused(chip: Hmc5883l, registers: Registers) -> None:
    registers[CHIP][0x0A:0x0D] = b"H53"
    with pytest.raises(WrongDevice, match=r"reads 48 35 33; expected 48 34 33 \(H43\)"):
        chip.identify()


def test_an_absent_chip_is_named_plainly(chip: Hmc5883l, registers: Registers) -> None:
    registers.clear()
    expected = r"HMC5883L at 0x1e on i2c-1: no answer; expected the identity 48 34 33$"
    with pytest.raises(NoAcknowledge, match=expected):
        chip.identify()


@pytest.mark.parametrize(
    ("addresses", "named"),
    [
        ((0x0D,), "0x0d answers, likely a QMC5883L, which"),
        ((0x2C,), "0x2c answers, likely a QMC5883P, which"),
        ((0x0D, 0x2C), "0x0d answers, likely a QMC5883L, 0x2c answers, likely a QMC5883P"),
    ],
)
def test_a_chip_sold_under_this_name_is_named(
    chip: Hmc5883l, registers: Registers, addresses: tuple[int, ...], named: str
) -> None:
    del registers[CHIP]
    registers.update({address: bytearray(256) for address in addresses})
    with pytest.raises(NoAcknowledge, match=named):
        chip.identify()


def test_verify_says_what_was_found_and_expected(chip: Hmc5883l, registers: Registers) -> None:
    chip.verify()
    registers[CHIP][0x00] = 0x10
    with pytest.raises(NotReady, match="CRA, CRB read 10 20, expected 70 20; it was reset"):
        chip.verify()


# Measurements -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("range_gauss", "counts_per_gauss"),
    [
        (0.88, 1370),
        (1.3, 1090),
        (1.9, 820),
        (2.5, 660),
        (4.0, 440),
        (4.7, 390),
        (5.6, 330),
        (8.1, 230),
    ],
)
def test_counts_become_tesla_in_the_order_x_z_y(
    register_bus: I2cBus, registers: Registers, range_gauss: float, counts_per_gauss: int
) -> None:
    chip = Hmc5883l(register_bus, Hmc5883lSettings(range_gauss=range_gauss))
    bring_up(chip, registers)
    measure(chip, registers, x=counts_per_gauss, y=-2048, z=2047)
    expected = (1e-4, -2048e-4 / counts_per_gauss, 2047e-4 / counts_per_gauss)
    assert chip.read_field() == pytest.approx(expected)


def test_a_reading_takes_all_six_data_bytes_in_one_burst(
    chip: Hmc5883l, registers: Registers, wire: Wire
) -> None:
    measure(chip, registers, 100, 0, 0)
    wire.clear()
    chip.read_field()
    assert wire == [(CHIP, (b"\x00", 9))]


@pytest.mark.parametrize("mode", [0x02, 0x03, 0x83])
def test_both_idle_codes_say_that_a_measurement_is_done(
    chip: Hmc5883l, registers: Registers, mode: int
) -> None:
    measure(chip, registers, 100, 0, 0, mode=mode)
    assert chip.read_bearing().bearing_deg == 0.0


def test_a_measurement_under_way_is_not_ready_and_can_be_read_later(
    chip: Hmc5883l, registers: Registers
) -> None:
    measure(chip, registers, 100, 0, 0, mode=0x01)
    with pytest.raises(NotReady, match="MODE reads 01; expected 02 or 03"):
        chip.read_field()
    registers[CHIP][0x02] = IDLE
    assert chip.read_field()[0] == pytest.approx(100e-4 / 1090)


def test_a_measurement_is_given_once(chip: Hmc5883l, registers: Registers) -> None:
    measure(chip, registers, 100, 0, 0)
    chip.read_field()
    with pytest.raises(NotReady, match="no measurement to read"):
        chip.read_field()


def test_identified_again_it_has_no_measurement_to_give(
    chip: Hmc5883l, registers: Registers
) -> None:
    measure(chip, registers, 100, 0, 0)
    chip.identify()
    with pytest.raises(NotReady, match="no measurement to read"):
        chip.read_field()


def test_a_start_that_was_not_acknowledged_leaves_nothing_of_the_one_before(
    chip: Hmc5883l, registers: Registers
) -> None:
    measure(chip, registers, 100, 0, 0)
    kept = registers.pop(CHIP)
    with pytest.raises(NoAcknowledge):
        chip.measurement[0].action()
    registers[CHIP] = kept
    with pytest.raises(NotReady, match="no measurement to read"):
        chip.read_field()


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_field_beyond_the_range_is_no_field(
    chip: Hmc5883l, registers: Registers, axis: str
) -> None:
    counts = {"x": 1, "y": 2, "z": 3} | {axis: -4096}
    measure(chip, registers, **counts)
    with pytest.raises(
        NotReady, match=rf"beyond the range on sensor axis {axis}; expected .*1\.3 G"
    ):
        chip.read_field()


def test_a_chip_that_lost_its_settings_is_not_read_at_another_scale(
    chip: Hmc5883l, registers: Registers
) -> None:
    measure(chip, registers, 100, 0, 0)
    registers[CHIP][0x00:0x02] = b"\x10\x20"
    with pytest.raises(NotReady, match="CRA, CRB read 10 20, expected 70 20"):
        chip.read_field()


# Bearings -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("bearing_deg", range(0, 360, 15))
def test_the_bearing_grows_as_the_robot_turns_right(
    chip: Hmc5883l, registers: Registers, bearing_deg: int
) -> None:
    angle = math.radians(bearing_deg)
    north_ahead, north_to_the_left = math.cos(angle), math.sin(angle)
    measure(chip, registers, round(2000 * north_ahead), round(2000 * north_to_the_left), -1500)
    reading = chip.read_bearing()
    assert reading.bearing_deg == pytest.approx(bearing_deg, abs=0.03)
    assert 0 <= reading.bearing_deg < 360
    assert reading.calibration is None


def test_data_that_stand_still_are_stuck(chip: Hmc5883l, registers: Registers) -> None:
    def again() -> None:
        measure(chip, registers, x=300, y=1, z=7)
        chip.read_bearing()

    for _ in range(10):
        again()
    with pytest.raises(Stuck) as caught:
        list(iter(again, again))
    assert caught.value.readings < 20
    measure(chip, registers, x=301, y=2, z=8)
    chip.read_bearing()


def test_the_mounting_turns_sensor_axes_into_the_bodys(
    register_bus: I2cBus, registers: Registers
) -> None:
    chip = Hmc5883l(register_bus, Hmc5883lSettings(mounting="+y -x +z"))
    bring_up(chip, registers)
    measure(chip, registers, x=-300, y=0, z=7)
    assert chip.read_bearing().bearing_deg == pytest.approx(90)


def test_the_robots_own_field_is_taken_off_in_body_axes(
    register_bus: I2cBus, registers: Registers
) -> None:
    settings = Hmc5883lSettings(mounting="+y -x +z", hard_iron=(0.0, 10e-6, 5e-6))
    chip = Hmc5883l(register_bus, settings)
    bring_up(chip, registers)
    measure(chip, registers, x=0, y=218, z=0)
    assert chip.read_field() == pytest.approx((20e-6, -10e-6, -5e-6))


def test_a_field_straight_down_has_no_bearing(chip: Hmc5883l, registers: Registers) -> None:
    measure(chip, registers, 10, -10, -500)
    with pytest.raises(NotReady, match=r"horizontal field is 1\.3 uT; expected 2 uT or more"):
        chip.read_bearing()


def test_all_settings_that_cannot_be_are_reported_at_once(register_bus: I2cBus, wire: Wire) -> None:
    settings = Hmc5883lSettings(range_gauss=2, mounting="up", hard_iron=(0.0, math.nan, 0.0))
    with pytest.raises(SettingError, match=r"range_gauss: 2, .*hard_iron: .*mounting: 'up'"):
        Hmc5883l(register_bus, settings)
    assert wire == []
