"""Sabertooth and MaxBotix against their doubles, in process and through pyserial on a real pty."""

import math
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from firmware_drivers.chips.maxbotix import Maxbotix
from firmware_drivers.chips.sabertooth import Sabertooth, SabertoothSettings

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.linux_serial import open_serial
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import BusFault, NotReady, PortClosed
from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.clock import ManualClock
from sim_doubles.serial_line import SerialLineDouble, SerialTarget
from sim_doubles.serial_pty import PtySerialLine
from tests.support.wire import take

# Sabertooth ---------------------------------------------------------------------------------------


class Sabertooths:
    """A Sabertooth double on a line, and our driver, brought up."""

    def __init__(self, *, autobaud: bool = True, tenths: int = 3) -> None:
        self.clock = ManualClock()
        self.double = SabertoothDouble(self.clock, 130, full_speed_rad_s=10.0, autobaud=autobaud)
        self.line = SerialLineDouble("ttyS0", self.clock, self.double)
        settings = SabertoothSettings(timeout_ns=tenths * SECOND // 10, autobaud=autobaud)
        self.driver = Sabertooth(self.line, 130, settings)
        self.bring_up()

    def bring_up(self) -> None:
        take(self.clock, self.driver.bring_up())

    def settle(self, left: float, right: float) -> tuple[float, float]:
        """Refresh for as long as any ramp takes; return the speeds as shares of full speed."""
        for _ in range(20):
            self.driver.set_speeds(left, right)
            self.clock.advance(100 * MILLISECOND)
        return self.double.speeds

    def stop_after(self, silence: int) -> None:
        self.clock.advance(silence)
        assert self.double.speeds == (0.0, 0.0)


HALF = pytest.approx((0.5, 0.5), abs=0.01)


@pytest.mark.parametrize("autobaud", [True, False])
def test_speeds_come_through_over_the_whole_range(*, autobaud: bool) -> None:
    motors = Sabertooths(autobaud=autobaud)
    for hundredths in range(-100, 101, 10):
        ordered = (hundredths / 100, -hundredths / 100)
        assert motors.settle(*ordered) == pytest.approx(ordered, abs=0.5 / 127 + 1e-9)
    assert list(motors.double.warnings) == []


@pytest.mark.parametrize("tenths", [1, 3, 127])
def test_motors_of_a_silent_program_stop_after_the_timeout_set(tenths: int) -> None:
    motors = Sabertooths(tenths=tenths)
    motors.settle(0.5, -0.5)
    motors.driver.set_speeds(0.5, -0.5)
    motors.clock.advance(motors.driver.timeout_ns - 1)
    assert motors.double.speeds != (0.0, 0.0)
    motors.stop_after(MILLISECOND)


@pytest.mark.parametrize("autobaud", [True, False])
def test_a_browned_out_autobaud_model_is_still_until_it_is_brought_up_again(
    *, autobaud: bool
) -> None:
    """One that stores its rate has its timeout again at once."""
    motors = Sabertooths(autobaud=autobaud)
    motors.settle(0.5, 0.5)
    motors.double.power_cycle()
    assert motors.settle(0.5, 0.5) == ((0.0, 0.0) if autobaud else HALF)
    motors.bring_up()
    assert motors.settle(0.5, 0.5) == HALF
    motors.stop_after(SECOND)


def test_a_port_that_is_gone_is_reported() -> None:
    motors = Sabertooths()
    motors.line.unplugged = True
    with pytest.raises(BusFault):
        motors.driver.stop()
    motors.line.close()
    with pytest.raises(PortClosed):
        motors.driver.stop()


# MaxBotix -----------------------------------------------------------------------------------------


class Sonars:
    """A MaxBotix double on a line, and our driver; `distance` is the world's."""

    def __init__(self, family: str = "xl", *, inverted: bool = False) -> None:
        self.clock = ManualClock()
        self.distance = 1.0
        self.double = MaxbotixDouble(
            self.clock, lambda _: self.distance, family=family, inverted=inverted
        )
        self.clock.advance(SECOND)  # powered up, banner included
        self.line = SerialLineDouble("ttyS0", self.clock, self.double)
        self.driver = Maxbotix(self.line, family)

    def range(self) -> float:
        self.driver.start_ranging()
        self.clock.advance(self.driver.ranging_ns)
        return self.driver.read_distance()


@pytest.mark.parametrize(
    ("family", "nearest_m", "farthest_m", "count_m"),
    [("lv", 0.1524, 6.4, 0.0254), ("xl", 0.2, 7.6, 0.01), ("hrlv", 0.3, 4.99, 0.001)],
)
def test_distances_come_through_over_the_whole_range(
    family: str, nearest_m: float, farthest_m: float, count_m: float
) -> None:
    sonars = Sonars(family)
    for step in range(60):
        sonars.distance = nearest_m + (farthest_m - nearest_m) * step / 59
        sonars.range()  # its ping may have been sent before the target moved
        assert sonars.range() == pytest.approx(sonars.distance, abs=count_m / 2 + 1e-9)
    sonars.distance = math.inf
    sonars.range()
    assert sonars.range() == math.inf


@pytest.mark.parametrize("family", ["lv", "xl", "hrlv"])
def test_a_frame_has_come_whenever_the_ranging_was_begun(family: str) -> None:
    sonars = Sonars(family)
    for _ in range(100):
        assert sonars.range() == pytest.approx(1.0, abs=0.0127)
        sonars.clock.advance(1_234_567)


def test_what_waited_in_the_buffer_is_not_given_and_the_power_up_banner_does_no_harm() -> None:
    sonars = Sonars()
    sonars.clock.advance(3 * SECOND)
    sonars.driver.start_ranging()
    with pytest.raises(NotReady):
        sonars.driver.read_distance()
    sonars.double.power_cycle()
    sonars.driver.start_ranging()
    sonars.clock.advance(SECOND)
    assert sonars.driver.read_distance() == 1.0


# Through pyserial ---------------------------------------------------------------------------------


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


@contextmanager
def pty_of(chip: SerialTarget, clock: ManualClock) -> Iterator[tuple[PtySerialLine, SerialPort]]:
    line = PtySerialLine(chip, clock)
    port = open_serial("port", line.path)
    yield line, port
    port.close()
    line.close()


def test_a_sonar_is_read_through_a_real_port(clock: ManualClock) -> None:
    with pty_of(MaxbotixDouble(clock, lambda _: 2.5, family="hrlv"), clock) as (line, port):
        clock.advance(SECOND)
        sonar = Maxbotix(port, "hrlv")
        for step in sonar.bring_up():
            step.action()
            clock.advance(step.wait_ns)
            line.pump()
        sonar.start_ranging()
        with pytest.raises(NotReady):
            sonar.read_distance()
        clock.advance(sonar.ranging_ns)
        line.pump()
        assert sonar.read_distance() == 2.5


def test_motors_are_driven_through_a_real_port_and_outlive_it(clock: ManualClock) -> None:
    double = SabertoothDouble(clock)
    with pty_of(double, clock) as (line, port):
        driver = Sabertooth(port)
        for step in driver.bring_up():
            step.action()
            line.pump()
            clock.advance(step.wait_ns)
        for _ in range(20):
            driver.set_speeds(0.5, -1.0)
            line.pump()
            clock.advance(100 * MILLISECOND)
        assert double.speeds == pytest.approx((0.5, -1.0), abs=0.01)
    clock.advance(SECOND)
    assert double.speeds == (0.0, 0.0)
