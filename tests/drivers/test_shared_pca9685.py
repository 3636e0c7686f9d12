"""One PCA9685 whose outputs several models drive: brought up once, stopped each on its own."""

from collections.abc import Iterator

import pytest
from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.dc_motor import DcMotor, DcMotorSettings
from firmware_drivers.hardware import BringUp

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady
from sim_doubles.clock import ManualClock
from sim_doubles.faults import FaultScript, NackAddress
from tests.support.wired_pca9685 import WiredPca9685


class Rig(WiredPca9685):
    def __init__(self) -> None:
        super().__init__(ManualClock())
        self.double, self.driver = self.chip, Pca9685(self.bus, 0x40)

    def bring_up(self, frequency_hz: float = 1000.0) -> BringUp:
        begun = BringUp(lambda: self.driver.share_bring_up(frequency_hz))
        begun.restart()
        return begun

    def finish(self, *begun: BringUp) -> list[str]:
        """Take steps in turns, each wait in full; return the steps' names."""
        names = []
        left = list(begun)
        while left:
            waits = []
            for each in list(left):
                wait = each.take()
                if wait is None:
                    left.remove(each)
                else:
                    names.append(each.step)
                    waits.append(wait)
            self.clock.advance(max(waits, default=0))
        return names


@pytest.fixture
def rig() -> Rig:
    return Rig()


def test_one_model_takes_the_steps_and_the_others_wait(rig: Rig) -> None:
    names = rig.finish(rig.bring_up(), rig.bring_up(), rig.bring_up())
    assert names.count("wake") == 1
    assert names.count("verify") == 3
    assert rig.driver.is_running
    assert rig.double.warnings == []


def test_the_outputs_of_others_stay_as_they_are_when_one_comes_later(rig: Rig) -> None:
    rig.finish(rig.bring_up())
    rig.driver.set_duties(0, (0.25, 0.5))
    rig.finish(rig.bring_up())
    assert rig.double.duties[:2] == (0.25, 0.5)


def test_a_chip_that_was_reset_is_brought_up_again_by_the_next_user(rig: Rig) -> None:
    rig.finish(rig.bring_up())
    rig.double.power_cycle()
    again = rig.bring_up()
    with pytest.raises(NotReady):
        again.take()
    assert "wake" in rig.finish(again)


def test_a_bring_up_that_failed_is_taken_over_by_one_that_waited(rig: Rig) -> None:
    first, second = rig.bring_up(), rig.bring_up()
    rig.bus.faults = FaultScript([NackAddress(address=0x40, times=1)])
    rig.clock.advance(first.take() or 0)
    with pytest.raises(NoAcknowledge):
        first.take()
    assert rig.finish(second).count("wake") == 1


def test_two_rates_on_one_chip_are_refused(rig: Rig) -> None:
    rig.finish(rig.bring_up(1000.0))
    with pytest.raises(SettingError, match="one rate"):
        rig.bring_up(50.0).take()


@pytest.mark.parametrize("is_running", [False, True])
def test_stopping_some_outputs_leaves_the_others_on(rig: Rig, *, is_running: bool) -> None:
    if is_running:
        rig.finish(rig.bring_up())
        rig.driver.set_duties(0, (0.5,) * 16)
    rig.driver.stop((3, 4, 5))
    assert rig.double.duties[3:6] == (0.0, 0.0, 0.0)
    assert [duty > 0.0 for duty in rig.double.duties].count(True) == (13 if is_running else 0)


def test_stopping_some_outputs_of_an_inverted_chip_stops_them_and_drives_the_others_as_set(
    rig: Rig,
) -> None:
    rig.finish(rig.bring_up())
    rig.driver.set_duties(0, (0.25,) * 16)
    rig.bus.write(0x40, b"\x01\x14")
    rig.driver.stop((3, 4, 5))
    assert rig.double.duties == (*(0.25,) * 3, 0.0, 0.0, 0.0, *(0.25,) * 10)


def motors(rig: Rig) -> Iterator[DcMotor]:
    settings = DcMotorSettings(1000.0, 100 * MILLISECOND)
    for first in (0, 3):
        bridge = HBridge(rig.driver, first, first + 1, first + 2)
        yield DcMotor(f"motor{first}", bridge, settings)


def test_a_motor_that_stops_leaves_the_other_one_turning(rig: Rig) -> None:
    left, right = motors(rig)
    rig.finish(rig.bring_up())
    for motor in (left, right):
        motor.commanded = 0.5
        motor.write_command()
    left.write_stop()
    assert rig.double.duties[:6] == (0.0, 0.0, 0.0, 0.5, 1.0, 0.0)
    assert left.command_timeout < SECOND
