"""Sabertooth and MaxBotix against their doubles, in process and through pyserial on a real pty."""

import math
from collections.abc import Iterator

import pytest
from firmware_drivers.chips.maxbotix import Maxbotix
from firmware_drivers.chips.sabertooth import Sabertooth, SabertoothSettings

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.linux_serial import open_serial
from firmware_runtime.hal.wire_errors import BusFault, NotReady, PortClosed
from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.chips.sabertooth import SabertoothDouble
from sim_doubles.clock import ManualClock
from sim_doubles.serial_line import SerialLineDouble
from sim_doubles.serial_pty import PtySerialLine


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


# Sabertooth ---------------------------------------------------------------------------------------


class Sabertooths:
    """A Sabertooth double on a line, and our driver, brought up."""

    def __init__(self, clock: ManualClock, *, autobaud: bool = True, tenths: int = 3) -> None:
        self.clock = clock
        self.double = SabertoothDouble(clock, 130, full_speed_rad_s=10.0, autobaud=autobaud)
        self.line = SerialLineDouble("ttyS0", clock, self.double)
        settings = SabertoothSettings(timeout_ns=tenths * SECOND // 10, autobaud=autobaud)
        self.driver = Sabertooth(self.line, 130, settings)
        self.bring_up()

    def bring_up(self) -> None:
        for step in self.driver.bring_up():
            step.action()
            self.clock.advance(step.wait_ns)

    def settle(self) -> tuple[float, float]:
        """Refresh for as long as any ramp takes; return the speeds as shares of full speed."""
        for _ in range(20):
            self.driver.set_speeds(*self.ordered)
            self.clock.advance(100 * MILLISECOND)
        return self.double.speeds

    ordered = (0.0, 0.0)


@pytest.mark.parametrize("autobaud", [True, False])
def test_speeds_come_through_over_the_whole_range(clock: ManualClock, *, autobaud: bool) -> None:
    motors = Sabertooths(clock, autobaud=autobaud)
    for hundredths in range(-100, 101, 10):
        motors.ordered = (hundredths / 100, -hundredths / 100)
        assert motors.settle() == pytest.approx(motors.ordered, abs=0.5 / 127 + 1e-9)
    assert list(motors.double.warnings) == []


@pytest.mark.parametrize("tenths", [1, 3, 127])
def test_motors_of_a_silent_program_stop_after_the_timeout_set(
    clock: ManualClock, tenths: int
) -> None:
    motors = Sabertooths(clock, tenths=tenths)
    motors.ordered = (0.5, -0.5)
    motors.settle()
    motors.driver.set_speeds(*motors.ordered)
    clock.advance(motors.driver.timeout_ns - 1)
    assert motors.double.speeds != (0.0, 0.0)
    clock.advance(MILLISECOND)
    assert motors.double.speeds == (0.0, 0.0)


def test_a_timeout_switched_off_by_another_program_is_back_with_the_next_refresh(
    clock: ManualClock,
) -> None:
    motors = Sabertooths(clock)
    motors.line.write(bytes.fromhex("82 0e 00 10"))
    motors.ordered = (0.5, 0.5)
    motors.settle()
    clock.advance(SECOND)
    assert motors.double.speeds == (0.0, 0.0)


def test_a_browned_out_autobaud_model_is_still_until_it_is_brought_up_again(
    clock: ManualClock,
) -> None:
    motors = Sabertooths(clock)
    motors.ordered = (0.5, 0.5)
    motors.settle()
    motors.double.power_cycle()
    assert motors.settle() == (0.0, 0.0)
    motors.bring_up()
    assert motors.settle() == pytest.approx((0.5, 0.5), abs=0.01)
    clock.advance(SECOND)
    assert motors.double.speeds == (0.0, 0.0)


def test_a_browned_out_model_that_stores_its_rate_has_its_timeout_again_at_once(
    clock: ManualClock,
) -> None:
    motors = Sabertooths(clock, autobaud=False)
    motors.double.power_cycle()
    motors.ordered = (0.5, 0.5)
    assert motors.settle() == pytest.approx((0.5, 0.5), abs=0.01)
    clock.advance(SECOND)
    assert motors.double.speeds == (0.0, 0.0)


def test_a_port_that_is_gone_is_reported(clock: ManualClock) -> None:
    motors = Sabertooths(clock)
    motors.line.unplugged = True
    with pytest.raises(BusFault):
        motors.driver.stop()
    motors.line.close()
    with pytest.raises(PortClosed):
        motors.driver.stop()


# MaxBotix -----------------------------------------------------------------------------------------


class Sonars:
    """A MaxBotix double on a line, and our driver; `distance` is the world's."""

    def __init__(self, clock: ManualClock, family: str, *, inverted: bool = False) -> None:
        self.clock = clock
        self.distance = 1.0
        self.double = MaxbotixDouble(
            clock, lambda _: self.distance, family=family, inverted=inverted
        )
        clock.advance(SECOND)  # powered up, banner included
        self.line = SerialLineDouble("ttyS0", clock, self.double)
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
    clock: ManualClock, family: str, nearest_m: float, farthest_m: float, count_m: float
) -> None:
    sonars = Sonars(clock, family)
    for step in range(60):
        sonars.distance = nearest_m + (farthest_m - nearest_m) * step / 59
        sonars.range()  # its ping may have been sent before the target moved
        assert sonars.range() == pytest.approx(sonars.distance, abs=count_m / 2 + 1e-9)
    sonars.distance = math.inf
    sonars.range()
    assert sonars.range() == math.inf


@pytest.mark.parametrize("family", ["lv", "xl", "hrlv"])
def test_a_frame_has_come_whenever_the_ranging_was_begun(clock: ManualClock, family: str) -> None:
    sonars = Sonars(clock, family)
    for _ in range(100):
        assert sonars.range() == pytest.approx(1.0, abs=0.0127)
        clock.advance(1_234_567)


def test_what_waited_in_the_buffer_is_not_given(clock: ManualClock) -> None:
    sonars = Sonars(clock, "xl")
    clock.advance(3 * SECOND)
    sonars.driver.start_ranging()
    with pytest.raises(NotReady):
        sonars.driver.read_distance()


def test_the_power_up_banner_does_no_harm(clock: ManualClock) -> None:
    sonars = Sonars(clock, "xl")
    sonars.double.power_cycle()
    sonars.driver.start_ranging()
    clock.advance(SECOND)
    assert sonars.driver.read_distance() == 1.0


def test_an_inverted_sonar_is_found_at_bring_up(clock: ManualClock) -> None:
    sonars = Sonars(clock, "xl", inverted=True)
    listen, identify = sonars.driver.bring_up()
    listen.action()
    clock.advance(listen.wait_ns)
    with pytest.raises(NotReady, match="its signal is inverted"):
        identify.action()


def test_a_cut_line_is_reported_as_silence_and_reconnected_it_goes_on(clock: ManualClock) -> None:
    sonars = Sonars(clock, "xl")
    sonars.line.cut()
    with pytest.raises(NotReady, match="nothing received"):
        sonars.range()
    sonars.line.reconnect()
    assert sonars.range() == 1.0


# Through pyserial ---------------------------------------------------------------------------------


@pytest.fixture
def maxbotix_pty(clock: ManualClock) -> Iterator[PtySerialLine]:
    line = PtySerialLine(MaxbotixDouble(clock, lambda _: 2.5, family="hrlv"), clock)
    yield line
    line.close()


@pytest.fixture
def sabertooth(clock: ManualClock) -> SabertoothDouble:
    return SabertoothDouble(clock)


@pytest.fixture
def sabertooth_pty(clock: ManualClock, sabertooth: SabertoothDouble) -> Iterator[PtySerialLine]:
    line = PtySerialLine(sabertooth, clock)
    yield line
    line.close()


def test_a_sonar_is_read_through_a_real_port(
    clock: ManualClock, maxbotix_pty: PtySerialLine
) -> None:
    clock.advance(SECOND)
    port = open_serial("sonar", maxbotix_pty.path)
    sonar = Maxbotix(port, "hrlv")
    for step in sonar.bring_up():
        step.action()
        clock.advance(step.wait_ns)
        maxbotix_pty.pump()
    sonar.start_ranging()
    with pytest.raises(NotReady):
        sonar.read_distance()
    clock.advance(sonar.ranging_ns)
    maxbotix_pty.pump()
    assert sonar.read_distance() == 2.5
    port.close()


def test_motors_are_driven_through_a_real_port(
    clock: ManualClock, sabertooth: SabertoothDouble, sabertooth_pty: PtySerialLine
) -> None:
    port = open_serial("treads", sabertooth_pty.path)
    driver = Sabertooth(port)
    for step in driver.bring_up():
        step.action()
        sabertooth_pty.pump()
        clock.advance(step.wait_ns)
    for _ in range(20):
        driver.set_speeds(0.5, -1.0)
        sabertooth_pty.pump()
        clock.advance(100 * MILLISECOND)
    assert sabertooth.speeds == pytest.approx((0.5, -1.0), abs=0.01)
    port.close()
    clock.advance(SECOND)
    assert sabertooth.speeds == (0.0, 0.0)
