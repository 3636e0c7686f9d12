"""pysabertooth, as published, at the pty of a Sabertooth double."""

from collections.abc import Callable
from typing import Any

import pytest
from pysabertooth import Sabertooth

from sim_doubles.serial_pty import SerialPty
from sim_doubles.testing.virtual_time import VirtualTime

FULL_SPEED_RAD_S = 17.8


class Rig:
    """The driver and its device, in virtual time."""

    def __init__(self, line: SerialPty, time: VirtualTime) -> None:
        self.double = line.double
        self.sleep = time.sleep
        self.saber: Any = Sabertooth(line.path)


@pytest.fixture
def rig(virtual_time: VirtualTime, serial_double: Callable[..., SerialPty]) -> Rig:
    return Rig(serial_double("sabertooth"), virtual_time)


@pytest.mark.usefixtures("no_protocol_warning")
def test_each_motor_is_driven_each_way_in_frames_as_the_manual_has_them(rig: Rig) -> None:
    rig.saber.drive(1, 50)
    rig.saber.drive(2, -50)
    rig.sleep(3.0)
    half = FULL_SPEED_RAD_S / 2
    assert rig.double.speeds_rad_s == pytest.approx((half, -half), rel=0.02)
    for percent in (100, -100, 0):
        rig.saber.driveBoth(percent, percent)
        rig.sleep(3.0)
        assert rig.double.speeds == (percent / 100, percent / 100)
    rig.saber.stop()
    rig.sleep(3.0)
    assert rig.double.speeds == (0.0, 0.0)


def test_silence_stops_the_motors_once_the_timeout_is_set(rig: Rig) -> None:
    rig.saber.sendCommand(14, 3)
    rig.saber.drive(1, 100)
    rig.sleep(0.29)
    assert rig.double.speeds[0] > 0
    rig.sleep(0.02)
    assert rig.double.speeds == (0.0, 0.0)


def test_a_frame_with_a_wrong_checksum_is_noticed_and_does_nothing(
    rig: Rig, no_protocol_warning: Callable[[], None]
) -> None:
    no_protocol_warning()
    rig.saber.saber.write(bytes([128, 0, 100, 0]))
    rig.sleep(1.0)
    assert rig.double.speeds == (0.0, 0.0)
    with pytest.raises(pytest.fail.Exception, match="Sabertooth"):
        no_protocol_warning()
    rig.double.warnings.clear()
