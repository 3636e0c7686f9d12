"""What the chip contract does not ask of each chip: its own time, its own traps."""

import math
from collections.abc import Sequence

import pytest
from firmware_drivers.chips.hmc5883l import Hmc5883l, Hmc5883lSettings
from firmware_drivers.chips.md25 import Md25, Md25Settings
from firmware_drivers.chips.srf08 import Srf08, Srf08Settings
from firmware_drivers.chips.step import Step

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady
from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


def take(clock: ManualClock, steps: Sequence[Step]) -> None:
    for step in steps:
        step.action()
        clock.advance(step.wait_ns)


# SRF08 --------------------------------------------------------------------------------------------


def srf08(
    clock: ManualClock, *echoes: float, max_range_m: float = 3.0
) -> tuple[Srf08, Srf08Double]:
    double = Srf08Double(clock, 0x73, echoes=lambda _: echoes)
    bus = I2cBusDouble("i2c-1", clock, [double])
    driver = Srf08(bus, 0x73, Srf08Settings(max_range_m=max_range_m))
    take(clock, driver.bring_up())
    return driver, double


@pytest.mark.parametrize("echoes", [(), (3.5,)])
def test_nothing_within_the_range_is_infinitely_far(
    clock: ManualClock, echoes: tuple[float, ...]
) -> None:
    driver, _ = srf08(clock, *echoes)
    driver.start_ranging()
    clock.advance(driver.ranging_ns)
    assert driver.read_distance() == math.inf


def test_the_first_of_several_echoes_is_the_distance(clock: ManualClock) -> None:
    driver, _ = srf08(clock, 0.8, 1.4, 2.0)
    driver.start_ranging()
    clock.advance(driver.ranging_ns)
    assert driver.read_distance() == 0.8


def test_at_every_range_the_chip_answers_when_the_driver_says_so_and_not_much_earlier(
    clock: ManualClock,
) -> None:
    for register in range(4, 256):
        driver, double = srf08(clock, max_range_m=(register + 1) * 0.043)
        driver.start_ranging()
        clock.advance(driver.ranging_ns - 2 * MILLISECOND)
        assert double.ranging
        clock.advance(2 * MILLISECOND)
        assert driver.read_distance() == math.inf
        assert double.farthest_m == pytest.approx((register + 1) * 0.043)


def test_a_reading_too_early_is_not_ready_and_spoils_nothing(clock: ManualClock) -> None:
    driver, _ = srf08(clock, 1.0)
    driver.start_ranging()
    clock.advance(driver.ranging_ns // 2)
    with pytest.raises(NotReady):
        driver.read_distance()
    clock.advance(driver.ranging_ns // 2)
    assert driver.read_distance() == 1.0


def test_a_ping_into_a_ranging_is_refused_by_the_silent_chip(clock: ManualClock) -> None:
    driver, double = srf08(clock, 1.0)
    driver.start_ranging()
    clock.advance(MILLISECOND)
    pings = double.pings
    with pytest.raises(NoAcknowledge):
        driver.start_ranging()
    assert double.pings == pings


# HMC5883L -----------------------------------------------------------------------------------------


def hmc5883l(
    clock: ManualClock, field: tuple[float, float, float], range_gauss: float = 1.3
) -> tuple[Hmc5883l, I2cBusDouble]:
    bus = I2cBusDouble("i2c-1", clock, [Hmc5883lDouble(clock, lambda _: field, noise_seed=None)])
    driver = Hmc5883l(bus, Hmc5883lSettings(range_gauss=range_gauss))
    take(clock, driver.bring_up())
    return driver, bus


@pytest.mark.parametrize("range_gauss", [0.88, 1.3, 8.1])
def test_the_first_reading_after_bring_up_has_the_new_scale(
    clock: ManualClock, range_gauss: float
) -> None:
    field = (30e-6, -20e-6, 10e-6)
    driver, _ = hmc5883l(clock, field, range_gauss)
    take(clock, driver.measurement)
    assert driver.read_field() == pytest.approx(field, abs=1e-4 / 230)


def test_data_that_another_program_left_locked_are_free_for_the_next_measurement(
    clock: ManualClock,
) -> None:
    field = (30e-6, -20e-6, 10e-6)
    driver, bus = hmc5883l(clock, field)
    bus.write_read(0x1E, b"\x03", 3)
    assert bus.write_read(0x1E, b"\x09", 1)[0] & 0x02
    take(clock, driver.measurement)
    assert driver.read_field() == pytest.approx(field, abs=1e-4 / 1090)


def test_an_overflow_names_the_axis_and_a_wider_range_cures_it(clock: ManualClock) -> None:
    field = (20e-6, 250e-6, 0.0)
    driver, _ = hmc5883l(clock, field, 0.88)
    take(clock, driver.measurement)
    with pytest.raises(NotReady, match="beyond the range on sensor axis y"):
        driver.read_bearing()
    wide, _ = hmc5883l(clock, field, 8.1)
    take(clock, wide.measurement)
    assert wide.read_bearing().bearing_deg == pytest.approx(85.4, abs=1)


def test_a_measurement_read_too_early_is_not_ready(clock: ManualClock) -> None:
    driver, _ = hmc5883l(clock, (30e-6, 0.0, 0.0))
    (step,) = driver.measurement
    step.action()
    clock.advance(5 * MILLISECOND)
    with pytest.raises(NotReady, match="MODE reads 01"):
        driver.read_bearing()


# MD25 ---------------------------------------------------------------------------------------------


class Motors:
    """An MD25 double on a bus, brought up by our driver when asked."""

    def __init__(self, clock: ManualClock) -> None:
        self.clock = clock
        self.double = Md25Double(clock, full_speed_rad_s=10.0)
        self.bus = I2cBusDouble("i2c-1", clock, [self.double])

    def bring_up(self, acceleration: int = 10) -> Md25:
        driver = Md25(self.bus, settings=Md25Settings(acceleration=acceleration))
        take(self.clock, driver.bring_up())
        return driver

    @property
    def speeds(self) -> tuple[float, float]:
        return self.double.speeds_rad_s


@pytest.fixture
def motors(clock: ManualClock) -> Motors:
    return Motors(clock)


def test_motors_of_a_silent_program_stop_after_two_seconds(
    motors: Motors, clock: ManualClock
) -> None:
    driver = motors.bring_up()
    driver.set_speeds(0.5, 0.5)
    clock.advance(driver.timeout_ns - 1)
    assert motors.speeds == pytest.approx((5.0, 5.0), abs=0.05)
    clock.advance(1)
    assert motors.speeds == (0.0, 0.0)


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_no_speed_is_set_in_a_mode_that_another_program_has_changed(
    motors: Motors, clock: ManualClock, mode: int
) -> None:
    """In a signed mode half ahead of mode 0 is half astern; in a turning one it is a turn."""
    driver = motors.bring_up()
    driver.set_speeds(0.5, 0.5)
    clock.advance(SECOND)
    motors.bus.write(0x58, bytes((0x0F, mode)))
    with pytest.raises(NotReady, match=f"acceleration, mode read 10, {mode}, expected 10, 0"):
        driver.set_speeds(0.5, 0.5)
    clock.advance(SECOND)
    assert motors.speeds == (0.0, 0.0)


def test_a_timeout_a_former_program_switched_off_is_on_again(
    motors: Motors, clock: ManualClock
) -> None:
    motors.bus.write(0x58, b"\x10\x32")
    motors.bring_up().set_speeds(0.5, 0.5)
    clock.advance(3 * SECOND)
    assert motors.speeds == (0.0, 0.0)


@pytest.mark.parametrize(("mode", "stop"), [(0, 128), (1, 0), (2, 128), (3, 0)])
def test_speeds_that_are_not_stop_are_read_back_in_any_mode(
    motors: Motors, mode: int, stop: int
) -> None:
    driver = Md25(motors.bus)
    motors.bus.write(0x58, bytes((0x0F, mode)))
    motors.bus.write(0x58, bytes((0x00, stop, stop)))
    assert driver.still_on() is None
    motors.bus.write(0x58, bytes((0x00, stop, stop + 1)))
    assert f"speeds read {stop}, {stop + 1}" in str(driver.still_on())
    driver.stop()
    assert driver.still_on() is None


@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_bring_up_only_slows_what_a_former_program_left_turning(
    motors: Motors, clock: ManualClock, mode: int
) -> None:
    full_ahead = {0: b"\x00\xff\xff", 1: b"\x00\x7f\x7f", 2: b"\x00\xff\x80", 3: b"\x00\x7f\x00"}
    motors.bus.write(0x58, bytes((0x0F, mode)))
    motors.bus.write(0x58, full_ahead[mode])
    clock.advance(SECOND)
    former = min(motors.speeds)
    assert former > 5.0
    for step in Md25(motors.bus).bring_up():
        step.action()
        clock.advance(25 * MILLISECOND)
        assert 0.0 <= min(motors.speeds) <= max(motors.speeds) <= former + 1e-9, step.name
        former = max(motors.speeds)
    clock.advance(2 * SECOND - 1)
    assert motors.speeds == (0.0, 0.0)


def test_a_stop_after_a_power_loss_is_still_a_stop(motors: Motors, clock: ManualClock) -> None:
    driver = motors.bring_up()
    driver.set_speeds(0.5, 0.5)
    motors.bus.power_cycle()
    driver.stop()
    clock.advance(SECOND)
    assert motors.speeds == (0.0, 0.0)


def test_the_ramp_is_as_long_as_set(motors: Motors, clock: ManualClock) -> None:
    motors.bring_up(acceleration=1).set_speeds(1.0, -1.0)
    clock.advance(1000 * MILLISECOND)
    assert motors.speeds == pytest.approx((10 * 40 / 127, -10 * 40 / 127))
