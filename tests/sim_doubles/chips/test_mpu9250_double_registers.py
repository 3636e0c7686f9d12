"""MPU-9250 double: identity, pointer, reset, sleep, start-up, and what the host must not write."""

import pytest

from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.inertial_truth import InertialTruth

MILLISECOND = 1_000_000
TRUTH = InertialTruth((0.0, 0.0, 9.80665), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), 25.0)
REST = b"\x00\x00\x00\x00\x40\x00\x05\x37"  # 0, 0, 1 g at +-2 g; 25 degC


@pytest.fixture
def mpu(clock: ManualClock) -> Mpu9250Double:
    return Mpu9250Double(clock, lambda _: TRUTH, noise_seed=None)


@pytest.fixture
def bus(clock: ManualClock, mpu: Mpu9250Double) -> I2cBusDouble:
    return I2cBusDouble("i2c-1", clock, mpu.targets)


def register(bus: I2cBusDouble, number: int) -> int:
    return bus.write_read(0x68, bytes([number]), 1)[0]


# Registers


def test_identity_and_power_up_values(bus: I2cBusDouble) -> None:
    assert register(bus, 0x75) == 0x71
    assert register(bus, 0x6B) == 0x01
    zero_after_power_up = [*range(0x13, 0x37), 0x37, 0x38, *range(0x63, 0x6B), 0x6C]
    assert [register(bus, number) for number in zero_after_power_up] == [0] * 47


@pytest.mark.parametrize("identity", [0x70, 0x73, 0x75])
def test_modules_with_another_die_can_be_had(clock: ManualClock, identity: int) -> None:
    mpu = Mpu9250Double(clock, lambda _: TRUTH, 0x69, who_am_i=identity, noise_seed=None)
    bus = I2cBusDouble("i2c-1", clock, mpu.targets)
    assert bus.write_read(0x69, b"\x75", 1) == bytes([identity])
    with pytest.raises(NoAcknowledge):
        bus.write_read(0x68, b"\x75", 1)


def test_factory_values_are_not_zero(bus: I2cBusDouble) -> None:
    codes = [register(bus, number) for number in (0x00, 0x01, 0x02, 0x0D, 0x0E, 0x0F)]
    trims = [register(bus, number) for number in (0x77, 0x7A, 0x7D)]
    assert all(codes)
    assert all(trims)


def test_pointer_wraps_at_0x7f(bus: I2cBusDouble) -> None:
    bus.write(0x68, b"\x7f\x5a\x11\x22")
    assert bus.write_read(0x68, b"\x7f", 3) == b"\x5a\x11\x22"
    assert bus.write_read(0x68, b"\x00", 2) == b"\x11\x22"


def test_unlisted_register_keeps_what_is_written(bus: I2cBusDouble) -> None:
    bus.write(0x68, b"\x03\xa5")
    assert register(bus, 0x03) == 0xA5


@pytest.mark.parametrize("number", [0x35, 0x36, 0x3A, 0x3B, 0x49, 0x60, 0x72, 0x73, 0x75])
def test_read_only_register_ignores_writes(
    bus: I2cBusDouble, mpu: Mpu9250Double, number: int
) -> None:
    before = register(bus, number)
    bus.write(0x68, bytes([number, ~before & 0xFF]))
    assert register(bus, number) == before
    assert f"register 0x{number:02x} is read-only" in mpu.warnings[0]


def test_self_clearing_bits_read_zero(bus: I2cBusDouble) -> None:
    bus.write(0x68, b"\x6a\x07")
    bus.write(0x68, b"\x68\x07")
    assert (register(bus, 0x6A), register(bus, 0x68)) == (0, 0)


# Reset and power


def test_reset_restores_registers_and_reads_1_for_100_ms(
    clock: ManualClock, bus: I2cBusDouble
) -> None:
    bus.write(0x68, b"\x1a\x03\x18")
    trim = register(bus, 0x77)
    bus.write(0x68, b"\x77\x00")
    bus.write(0x68, b"\x6b\x80")
    clock.advance(100 * MILLISECOND - 1)
    assert register(bus, 0x6B) == 0x81
    clock.advance(1)
    assert register(bus, 0x6B) == 0x01
    assert (register(bus, 0x1A), register(bus, 0x1B)) == (0, 0)
    assert register(bus, 0x77) == trim


def test_write_during_reset_is_lost_and_warned_of(
    clock: ManualClock, bus: I2cBusDouble, mpu: Mpu9250Double
) -> None:
    bus.write(0x68, b"\x6b\x80")
    clock.advance(99 * MILLISECOND)
    bus.write(0x68, b"\x19\x04")
    assert "register 0x19 written during H_RESET" in mpu.warnings[0]
    clock.advance(MILLISECOND)
    assert register(bus, 0x19) == 0
    bus.write(0x68, b"\x19\x04")
    assert register(bus, 0x19) == 4
    assert len(mpu.warnings) == 1


def test_quicker_reset_can_be_had_for_drivers_that_hardly_wait(clock: ManualClock) -> None:
    mpu = Mpu9250Double(clock, lambda _: TRUTH, reset_time=MILLISECOND, noise_seed=None)
    bus = I2cBusDouble("i2c-1", clock, mpu.targets)
    bus.write(0x68, b"\x6b\x80")
    clock.advance(MILLISECOND)
    bus.write(0x68, b"\x19\x04")
    assert register(bus, 0x19) == 4


def test_chip_is_deaf_for_11_ms_after_power_up(
    clock: ManualClock, bus: I2cBusDouble, mpu: Mpu9250Double
) -> None:
    bus.write(0x68, b"\x19\x04")
    mpu.power_cycle()
    clock.advance(11 * MILLISECOND - 1)
    with pytest.raises(NoAcknowledge):
        register(bus, 0x75)
    clock.advance(1)
    assert register(bus, 0x19) == 0


def test_sample_due_before_a_power_cycle_is_never_taken(clock: ManualClock) -> None:
    asked: list[int] = []

    def inertia(at: int) -> InertialTruth:
        asked.append(at)
        return TRUTH

    mpu = Mpu9250Double(clock, inertia, noise_seed=None)
    clock.advance(10 * MILLISECOND)
    mpu.power_cycle()
    clock.advance(MILLISECOND)
    mpu.catch_up()
    assert asked == [10 * MILLISECOND + n * 125_000 for n in range(1, 9)]


def test_i2c_if_dis_makes_the_chip_deaf_until_a_power_cycle(
    clock: ManualClock, bus: I2cBusDouble, mpu: Mpu9250Double
) -> None:
    bus.write(0x68, b"\x6a\x10")
    with pytest.raises(NoAcknowledge):
        register(bus, 0x75)
    assert "I2C_IF_DIS" in mpu.warnings[0]
    mpu.power_cycle()
    clock.advance(11 * MILLISECOND)
    assert register(bus, 0x75) == 0x71


def test_chip_powered_for_long_has_data_at_its_first_tick(
    clock: ManualClock, bus: I2cBusDouble
) -> None:
    assert register(bus, 0x3A) == 0x00
    clock.advance(125_000)  # 8 kHz after power-up
    assert register(bus, 0x3A) == 0x01
    assert bus.write_read(0x68, b"\x3b", 8) == REST


def test_gyro_is_silent_for_35_ms_after_waking_and_data_not_ready(
    clock: ManualClock, bus: I2cBusDouble
) -> None:
    bus.write(0x68, b"\x6b\x40")
    clock.advance(10 * MILLISECOND)
    bus.write(0x68, b"\x19\x00\x01")  # 1 kHz
    bus.write(0x68, b"\x6b\x01")
    register(bus, 0x3A)
    clock.advance(19 * MILLISECOND)
    assert bus.write_read(0x68, b"\x3a", 7) == bytes(7)
    clock.advance(MILLISECOND)
    assert bus.write_read(0x68, b"\x3a", 15) == b"\x00" + REST + bytes(6)
    clock.advance(14 * MILLISECOND)
    assert bus.write_read(0x68, b"\x3a", 15) == b"\x00" + REST + bytes(6)
    clock.advance(MILLISECOND)
    # 1 rad/s is 57.296 dps, at 131.072 counts a dps
    assert bus.write_read(0x68, b"\x3a", 15) == b"\x01" + REST + b"\x1d\x56" * 3


def test_gyro_starts_up_again_after_a_reset_and_after_standby(
    clock: ManualClock, bus: I2cBusDouble
) -> None:
    for byte_off, byte_on in ((0x80, None), (0x11, 0x01)):
        bus.write(0x68, bytes([0x6B, byte_off]))
        clock.advance(100 * MILLISECOND)  # what a reset takes
        assert bus.write_read(0x68, b"\x43", 6) == bytes(6)
        if byte_on is not None:
            bus.write(0x68, bytes([0x6B, byte_on]))
        register(bus, 0x3A)
        clock.advance(34 * MILLISECOND)
        assert register(bus, 0x3A) == 0x00
        clock.advance(MILLISECOND)
        assert register(bus, 0x3A) == 0x01
        clock.advance(100 * MILLISECOND)


@pytest.mark.parametrize("power", [0x41, 0x07])
def test_sleep_or_a_stopped_clock_keeps_the_last_sample(
    clock: ManualClock, bus: I2cBusDouble, mpu: Mpu9250Double, power: int
) -> None:
    clock.advance(MILLISECOND)
    bus.write(0x68, bytes([0x6B, power]))
    samples = mpu.samples
    register(bus, 0x3A)
    clock.advance(1000 * MILLISECOND)
    assert bus.write_read(0x68, b"\x3a", 9) == b"\x00" + REST
    assert mpu.samples == samples


def test_axis_switched_off_reads_zero(clock: ManualClock, bus: I2cBusDouble) -> None:
    bus.write(0x68, b"\x6c\x0a")  # accelerometer Z, gyro Y
    clock.advance(MILLISECOND)
    assert bus.write_read(0x68, b"\x3f", 2) == bytes(2)
    x, y, z = (bus.write_read(0x68, bytes([place]), 2) for place in (0x43, 0x45, 0x47))
    assert y == bytes(2)
    assert x == z != bytes(2)


def test_all_gyro_axes_off_leaves_accelerometer_data_ready(
    clock: ManualClock, bus: I2cBusDouble
) -> None:
    bus.write(0x68, b"\x6c\x07")
    clock.advance(MILLISECOND)
    assert bus.write_read(0x68, b"\x3a", 9) == b"\x01" + REST


def test_cycle_mode_is_warned_of(bus: I2cBusDouble, mpu: Mpu9250Double) -> None:
    bus.write(0x68, b"\x6b\x21")
    assert "CYCLE" in mpu.warnings[0]
