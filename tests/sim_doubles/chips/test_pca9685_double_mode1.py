"""PCA9685 double: sleep, RESTART, the sticky external clock, and the trap at address 0x70."""

import pytest

from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

HALF_ON_ALL = b"\xfa\x00\x00\x00\x08"
SLEEP, WAKE = b"\x00\x31", b"\x00\x21"


def mode1(bus: I2cBusDouble) -> int:
    return bus.write_read(0x40, b"\x00", 1)[0]


# Sleep


def test_sleep_stops_every_output_and_advances_the_world_first(
    awake: I2cBusDouble, pca: Pca9685Double
) -> None:
    awake.write(0x40, HALF_ON_ALL)
    awake.write(0x40, b"\x0a\x00\x10\x00\x00")  # channel 1 full-on
    seen: list[tuple[float, ...]] = []
    pca.before_change = lambda: seen.append(pca.duties[:2])
    awake.write(0x40, SLEEP)
    assert seen == [(0.5, 1.0)]
    assert pca.all_off
    assert not pca.running


def test_led_registers_take_values_asleep_but_outputs_stay_off(
    bus: I2cBusDouble, pca: Pca9685Double
) -> None:
    bus.write(0x40, b"\x00\x31")
    bus.write(0x40, HALF_ON_ALL)
    assert pca.all_off
    bus.write(0x40, WAKE)
    assert pca.duties == (0.5,) * 16


def test_led_write_within_500_us_of_waking_is_warned_of(
    clock: ManualClock, bus: I2cBusDouble, pca: Pca9685Double
) -> None:
    bus.write(0x40, WAKE)
    clock.advance(499_999)
    bus.write(0x40, HALF_ON_ALL)
    assert "within 500 us of waking; timing is undefined" in pca.warnings[0]
    clock.advance(1)
    bus.write(0x40, b"\xfa\x00\x00\x00\x04")
    assert len(pca.warnings) == 1


# RESTART


@pytest.fixture
def interrupted(clock: ManualClock, awake: I2cBusDouble) -> I2cBusDouble:
    """Return the bus with the chip put to sleep while its channels ran, and woken again."""
    awake.write(0x40, HALF_ON_ALL)
    awake.write(0x40, SLEEP)
    assert mode1(awake) == 0xB1
    awake.write(0x40, WAKE)
    clock.advance(500_000)
    return awake


def test_sleep_with_all_channels_full_off_sets_no_restart(awake: I2cBusDouble) -> None:
    awake.write(0x40, b"\x00\x31")
    assert mode1(awake) == 0x31


def test_orderly_shutdown_before_sleep_sets_no_restart(awake: I2cBusDouble) -> None:
    awake.write(0x40, HALF_ON_ALL)
    awake.write(0x40, b"\xfd\x10")
    awake.write(0x40, SLEEP)
    assert mode1(awake) == 0x31


def test_outputs_wait_for_restart_after_waking(
    interrupted: I2cBusDouble, pca: Pca9685Double
) -> None:
    assert mode1(interrupted) == 0xA1
    assert pca.all_off
    assert not pca.running


def test_restart_resumes_outputs_after_500_us_and_reads_zero(
    interrupted: I2cBusDouble, pca: Pca9685Double
) -> None:
    interrupted.write(0x40, b"\x00\xa1")
    assert mode1(interrupted) == 0x21
    assert pca.duties == (0.5,) * 16
    assert pca.warnings == []


def test_restart_written_zero_does_nothing(interrupted: I2cBusDouble, pca: Pca9685Double) -> None:
    interrupted.write(0x40, b"\x00\x21")
    assert mode1(interrupted) == 0xA1
    assert pca.all_off


def test_restart_within_500_us_is_ignored_and_warned_of(
    clock: ManualClock, interrupted: I2cBusDouble, pca: Pca9685Double
) -> None:
    interrupted.write(0x40, SLEEP)
    interrupted.write(0x40, WAKE)
    clock.advance(499_999)
    interrupted.write(0x40, b"\x00\xa1")
    assert mode1(interrupted) == 0xA1
    assert "RESTART written within 500 us" in pca.warnings[0]


def test_restart_in_the_byte_that_wakes_is_accepted_without_effect(
    interrupted: I2cBusDouble, pca: Pca9685Double
) -> None:
    interrupted.write(0x40, SLEEP)
    interrupted.write(0x40, b"\x00\xa1")
    assert mode1(interrupted) == 0xA1
    assert pca.all_off
    assert len(pca.warnings) == 1


def test_led_write_and_stop_withdraw_a_pending_restart(
    interrupted: I2cBusDouble, pca: Pca9685Double
) -> None:
    interrupted.write(0x40, b"\x06\x00\x00\x00\x04")
    assert mode1(interrupted) == 0x21
    assert pca.duties == (0.25,) + (0.5,) * 15


def test_with_och_only_four_registers_of_a_channel_withdraw_a_restart(
    interrupted: I2cBusDouble, pca: Pca9685Double
) -> None:
    interrupted.write(0x40, b"\x01\x0c")
    interrupted.write(0x40, b"\x06\x00\x00\x00")
    assert mode1(interrupted) == 0xA1
    interrupted.write(0x40, b"\x09\x04")
    assert mode1(interrupted) == 0x21
    assert pca.duty(0) == 0.25


@pytest.mark.parametrize("cure", ["software reset", "power cycle"])
def test_reset_clears_a_pending_restart(
    interrupted: I2cBusDouble, pca: Pca9685Double, cure: str
) -> None:
    if cure == "software reset":
        interrupted.write(0x00, b"\x06")
    else:
        pca.power_cycle()
    assert mode1(interrupted) == 0x11


# EXTCLK


def test_external_clock_is_ignored_awake(awake: I2cBusDouble, pca: Pca9685Double) -> None:
    awake.write(0x40, b"\x00\x61")
    assert mode1(awake) == 0x21
    assert "EXTCLK written awake" in pca.warnings[0]


def test_external_clock_set_asleep_sticks_and_stops_outputs(
    bus: I2cBusDouble, pca: Pca9685Double
) -> None:
    bus.write(0x40, b"\x00\x51")
    bus.write(0x40, WAKE)
    bus.write(0x40, HALF_ON_ALL)
    assert mode1(bus) == 0x61
    assert pca.all_off
    assert pca.frequency_hz == 0.0
    assert any("EXTCLK set" in warning for warning in pca.warnings)
    assert any("EXTCLK written 0" in warning for warning in pca.warnings)


def test_external_clock_that_is_there_sets_the_frequency(clock: ManualClock) -> None:
    pca = Pca9685Double(clock, external_clock_hz=4096 * 31 * 100.0)
    bus = I2cBusDouble("i2c-1", clock, [pca])
    bus.write(0x40, b"\x00\x51")
    bus.write(0x40, b"\x00\x61")
    clock.advance(1_000_000)
    bus.write(0x40, HALF_ON_ALL)
    assert pca.frequency_hz == pytest.approx(100.0)
    assert pca.duties == (0.5,) * 16


@pytest.mark.parametrize("cure", ["software reset", "power cycle"])
def test_only_a_reset_clears_the_external_clock(
    bus: I2cBusDouble, pca: Pca9685Double, cure: str
) -> None:
    bus.write(0x40, b"\x00\x51")
    bus.write(0x40, b"\x00\x11")
    assert mode1(bus) == 0x51
    if cure == "software reset":
        bus.write(0x00, b"\x06")
    else:
        pca.power_cycle()
    assert mode1(bus) == 0x11


# The trap: a sonar's "range in cm", register 0 <- 0x51, at 0x70

PING = b"\x00\x51"


def test_first_sonar_ping_at_0x70_puts_an_awake_chip_to_sleep(
    awake: I2cBusDouble, pca: Pca9685Double
) -> None:
    awake.write(0x40, HALF_ON_ALL)
    awake.write(0x70, PING)
    assert pca.all_off
    assert mode1(awake) == 0x91  # RESTART, SLEEP, ALLCALL; not yet EXTCLK


def test_second_sonar_ping_at_0x70_latches_the_external_clock(
    clock: ManualClock, awake: I2cBusDouble, pca: Pca9685Double
) -> None:
    awake.write(0x40, HALF_ON_ALL)
    awake.write(0x70, PING)
    awake.write(0x70, PING)
    assert mode1(awake) == 0xD1
    awake.write(0x40, WAKE)
    clock.advance(1_000_000)
    awake.write(0x40, HALF_ON_ALL)
    assert mode1(awake) == 0x61
    assert pca.all_off


def test_one_sonar_ping_is_enough_for_a_chip_asleep(bus: I2cBusDouble) -> None:
    bus.write(0x70, PING)
    assert mode1(bus) == 0x51


def test_sonar_ping_passes_by_once_all_call_is_off(awake: I2cBusDouble, pca: Pca9685Double) -> None:
    awake.write(0x40, b"\x00\x20")
    awake.write(0x40, HALF_ON_ALL)
    with pytest.raises(OSError, match="0x70"):
        awake.write(0x70, PING)
    assert pca.duties == (0.5,) * 16
