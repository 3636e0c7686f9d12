"""What the chip contract does not ask of each chip: its own time, its own traps."""

import math

import pytest
from firmware_drivers.chips.hmc5883l import Hmc5883l, Hmc5883lSettings
from firmware_drivers.chips.md25 import Md25, Md25Settings
from firmware_drivers.chips.srf08 import Srf08, Srf08Settings

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.hal.wire_errors import NotReady
from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.srf08 import Srf08Double
from sim_doubles.clock import ManualClock
from tests.support.wire import WiredChip

# SRF08 --------------------------------------------------------------------------------------------


class Sonar(WiredChip[Srf08Double]):
    """An SRF08 before echoes, and its driver, brought up."""

    def __init__(self, *echoes: float, max_range_m: float = 3.0) -> None:
        clock = ManualClock()
        chip = Srf08Double(clock, 0x73, echoes=lambda _: echoes)
        super().__init__(clock, chip, 0x73, [chip])
        self.driver = Srf08(self.bus, 0x73, Srf08Settings(max_range_m=max_range_m))
        self.take(self.driver.bring_up())


def test_at_every_range_the_chip_answers_when_the_driver_says_so_and_not_much_earlier() -> None:
    for register in range(4, 256):
        sonar = Sonar(max_range_m=(register + 1) * 0.043)
        sonar.driver.start_ranging()
        sonar.clock.advance(sonar.driver.ranging_ns - 2 * MILLISECOND)
        assert sonar.chip.ranging
        sonar.wait(2)
        assert sonar.driver.read_distance() == math.inf
        assert sonar.chip.farthest_m == pytest.approx((register + 1) * 0.043)


# HMC5883L -----------------------------------------------------------------------------------------


FIELD = (30e-6, -20e-6, 10e-6)


class Compass(WiredChip[Hmc5883lDouble]):
    """An HMC5883L in a field, and its driver, brought up."""

    def __init__(self, field: tuple[float, float, float] = FIELD, range_gauss: float = 1.3) -> None:
        clock = ManualClock()
        chip = Hmc5883lDouble(clock, lambda _: field, noise_seed=None)
        super().__init__(clock, chip, 0x1E, [chip])
        self.driver = Hmc5883l(self.bus, Hmc5883lSettings(range_gauss=range_gauss))
        self.take(self.driver.bring_up())

    def measured(self) -> Hmc5883l:
        self.take(self.driver.measurement)
        return self.driver


@pytest.mark.parametrize("range_gauss", [0.88, 1.3, 8.1])
def test_the_first_reading_after_bring_up_has_the_new_scale(range_gauss: float) -> None:
    found = Compass(range_gauss=range_gauss).measured().read_field()
    assert found == pytest.approx(FIELD, abs=1e-4 / 230)


def test_data_that_another_program_left_locked_are_free_for_the_next_measurement() -> None:
    compass = Compass()
    compass.read(0x03, 3)
    assert compass.read(0x09)[0] & 0x02
    assert compass.measured().read_field() == pytest.approx(FIELD, abs=1e-4 / 1090)


# MD25 ---------------------------------------------------------------------------------------------


STILL = "speeds_rad_s is 0 0"


class Motors(WiredChip[Md25Double]):
    """An MD25, brought up by our driver when asked."""

    def __init__(self) -> None:
        clock = ManualClock()
        chip = Md25Double(clock, full_speed_rad_s=10.0)
        super().__init__(clock, chip, 0x58, [chip])

    def at_half(self) -> Md25:
        driver = self.bring_up()
        driver.set_speeds(0.5, 0.5)
        return driver

    def bring_up(self, acceleration: int = 10) -> Md25:
        driver = Md25(self.bus, settings=Md25Settings(acceleration=acceleration))
        self.take(driver.bring_up())
        return driver


@pytest.fixture
def motors() -> Motors:
    return Motors()


def test_motors_of_a_silent_program_stop_after_two_seconds(motors: Motors) -> None:
    motors.clock.advance(motors.at_half().timeout_ns - 1)
    assert motors.chip.speeds_rad_s == pytest.approx((5.0, 5.0), abs=0.05)
    motors.play("1 ns", STILL)


@pytest.mark.parametrize("mode", [1, 2, 3])
def test_no_speed_is_set_in_a_mode_that_another_program_has_changed(
    motors: Motors, mode: int
) -> None:
    """In a signed mode half ahead of mode 0 is half astern; in a turning one it is a turn."""
    driver = motors.at_half()
    motors.play(f"1 s; W 0f {mode:02x}")
    with pytest.raises(NotReady, match=f"acceleration, mode read 10, {mode}, expected 10, 0"):
        driver.set_speeds(0.5, 0.5)
    motors.play("1 s", STILL)


@pytest.mark.parametrize(("mode", "stop"), [(0, 128), (1, 0), (2, 128), (3, 0)])
def test_speeds_that_are_not_stop_are_read_back_in_any_mode(
    motors: Motors, mode: int, stop: int
) -> None:
    driver = Md25(motors.bus)
    motors.play(f"W 0f {mode:02x}; W 00 {stop:02x} {stop:02x}")
    assert driver.still_on() is None
    motors.play(f"W 00 {stop:02x} {stop + 1:02x}")
    assert f"speeds read {stop}, {stop + 1}" in str(driver.still_on())
    driver.stop()
    assert driver.still_on() is None


@pytest.mark.parametrize(
    ("mode", "full_ahead"), list(enumerate(("ff ff", "7f 7f", "ff 80", "7f 00")))
)
def test_bring_up_only_slows_what_a_former_program_left_turning(
    motors: Motors, mode: int, full_ahead: str
) -> None:
    motors.play(f"W 0f {mode:02x}; W 00 {full_ahead}; 1 s")
    former = min(motors.chip.speeds_rad_s)
    assert former > 5.0
    for step in Md25(motors.bus).bring_up():
        step.action()
        motors.wait(25)
        slowest, fastest = sorted(motors.chip.speeds_rad_s)
        assert 0.0 <= slowest <= fastest <= former + 1e-9, step.name
        former = fastest
    motors.play("1.999999999 s", STILL)


def test_a_stop_after_a_power_loss_is_still_a_stop(motors: Motors) -> None:
    driver = motors.at_half()
    motors.power_cycle()
    driver.stop()
    motors.play("1 s", STILL)
