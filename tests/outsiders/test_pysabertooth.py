"""pysabertooth, as published, at the pty of a Sabertooth double."""

from collections.abc import Callable
from typing import Any

import pytest
from pysabertooth import Sabertooth

from sim_doubles.serial_pty import SerialPty
from sim_doubles.testing.virtual_time import VirtualTime

FULL_SPEED_RAD_S = 17.8


class Bench:
    """The driver and its device, in virtual time."""

    def __init__(self, line: SerialPty, time: VirtualTime) -> None:
        self.double = line.double
        self.sleep = time.sleep
        self.saber: Any = Sabertooth(line.path)


@pytest.fixture
def bench(virtual_time: VirtualTime, serial_double: Callable[..., SerialPty]) -> Bench:
    return Bench(serial_double("sabertooth"), virtual_time)


def test_half_of_full_speed_each_way(bench: Bench) -> None:
    bench.saber.drive(1, 50)
    bench.saber.drive(2, -50)
    bench.sleep(3.0)
    half = FULL_SPEED_RAD_S / 2
    assert bench.double.speeds_rad_s == pytest.approx((half, -half), rel=0.02)


def test_both_at_full_speed_and_stopped(bench: Bench) -> None:
    bench.saber.driveBoth(100, 100)
    bench.sleep(3.0)
    assert bench.double.speeds == (1.0, 1.0)
    bench.saber.stop()
    bench.sleep(3.0)
    assert bench.double.speeds == (0.0, 0.0)


def test_silence_stops_the_motors_once_the_timeout_is_set(bench: Bench) -> None:
    bench.saber.sendCommand(14, 3)
    bench.saber.drive(1, 100)
    bench.sleep(0.29)
    assert bench.double.speeds[0] > 0
    bench.sleep(0.02)
    assert bench.double.speeds == (0.0, 0.0)


@pytest.mark.usefixtures("no_protocol_warning")
def test_its_frames_are_all_as_the_manual_has_them(bench: Bench) -> None:
    for speed in (100, -100, 0):
        bench.saber.driveBoth(speed, speed)
        bench.sleep(1.0)
    assert bench.double.speeds == (0.0, 0.0)


def test_a_frame_with_a_wrong_checksum_is_noticed_and_does_nothing(
    bench: Bench, no_protocol_warning: Callable[[], None]
) -> None:
    no_protocol_warning()
    bench.saber.saber.write(bytes([128, 0, 100, 0]))
    bench.sleep(1.0)
    assert bench.double.speeds == (0.0, 0.0)
    with pytest.raises(pytest.fail.Exception, match="Sabertooth"):
        no_protocol_warning()
    bench.double.warnings.clear()
