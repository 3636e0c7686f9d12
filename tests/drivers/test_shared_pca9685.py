"""One PCA9685 whose outputs several models or bridges drive, and what may not share one."""

from collections.abc import Callable, Iterator
from itertools import islice

import pytest
from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.dc_motor import DcMotor, DcMotorSettings
from firmware_drivers.esc import Esc, EscSettings
from firmware_drivers.hardware import BringUp
from firmware_drivers.servo import Servos
from firmware_drivers.thrust_pairs import ThrustPairs, ThrustSettings

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.servos import PAN, servos_settings
from tests.support.wired_pca9685 import DrivenPca9685

OFF, ON, HALF = "00 00 00 10", "00 10 00 00", "00 00 00 08"


class Rig(DrivenPca9685):
    def begin(self, frequency_hz: float = 1000.0) -> BringUp:
        begun = BringUp(lambda: self.driver.share_bring_up(frequency_hz))
        begun.restart()
        return begun

    def names(self, begun: BringUp) -> Iterator[str]:
        """Take steps alone, each wait in full, and give their names."""
        while (wait := begun.take()) is not None:
            self.clock.advance(wait)
            yield begun.step

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


# Bring-up -----------------------------------------------------------------------------------------


def test_one_model_takes_the_steps_the_others_wait_and_a_later_one_changes_no_output(
    rig: Rig,
) -> None:
    names = rig.finish(rig.begin(), rig.begin(), rig.begin())
    assert (names.count("wake"), names.count("verify")) == (1, 3)
    assert rig.driver.is_running
    rig.driver.set_duties(0, (0.25, 0.5))
    before = rig.clock()
    rig.finish(rig.begin())
    assert rig.clock() == before, "at once"
    rig.play("duties is 0.25 0.5 0*14")
    with pytest.raises(SettingError, match="one rate"):
        rig.begin(50.0).take()


def test_a_chip_that_was_reset_is_brought_up_again_by_the_next_user(rig: Rig) -> None:
    rig.finish(rig.begin())
    rig.power_cycle()
    again = rig.begin()
    with pytest.raises(NotReady):
        again.take()
    assert "wake" in rig.finish(again)


def test_a_bring_up_that_failed_is_taken_over_by_one_that_waited(rig: Rig) -> None:
    first, second = rig.begin(), rig.begin()
    rig.bus.faults = FaultScript([NackAddress(address=0x40, times=1)])
    rig.clock.advance(first.take() or 0)
    with pytest.raises(NoAcknowledge):
        first.take()
    assert rig.finish(second).count("wake") == 1


@pytest.mark.parametrize("taken", [0, 1, 4, 99])
@pytest.mark.parametrize("is_shared", [False, True])
def test_a_bring_up_that_is_set_back_goes_on_with_its_next_step_and_one_that_is_over_stays_so(
    rig: Rig, taken: int, *, is_shared: bool
) -> None:
    give = rig.driver.share_bring_up if is_shared else rig.driver.bring_up
    begun, set_back = (BringUp(lambda: give(1000.0)) for _ in range(2))
    begun.restart()
    before = list(islice(rig.names(begun), taken))
    set_back.restore(begun.state())
    assert set_back.state() == begun.state()
    whole = [step.name for step in rig.driver.bring_up(1000.0)]
    assert [*before, *rig.names(set_back)] == whole


# Stopping -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("is_running", [False, True])
def test_stopping_some_outputs_leaves_the_others_on(rig: Rig, *, is_running: bool) -> None:
    if is_running:
        rig.bring_up().set_duties(0, (0.5,) * 16)
    rig.driver.stop((3, 4, 5))
    rig.play("duties is 0.5*3 0*3 0.5*10" if is_running else "all_off is True")


def test_stopping_some_outputs_of_an_inverted_chip_stops_them_and_drives_the_others_as_set(
    rig: Rig,
) -> None:
    rig.bring_up().set_duties(0, (0.25,) * 16)
    rig.play("W 01 14")
    rig.driver.stop((3, 4, 5))
    rig.play("duties is 0.25*3 0*3 0.25*10")


def test_a_motor_that_stops_leaves_the_other_one_turning(rig: Rig) -> None:
    settings = DcMotorSettings(1000.0, 100 * MILLISECOND)
    left, right = (
        DcMotor(f"motor{first}", HBridge(rig.driver, first, first + 1, first + 2), settings)
        for first in (0, 3)
    )
    rig.bring_up()
    for motor in (left, right):
        motor.commanded = 0.5
        motor.write_command()
    left.write_stop()
    rig.play("duties is 0*3 0.5 1 0*11")
    assert left.command_timeout < SECOND


# H-bridges ----------------------------------------------------------------------------------------


def test_each_order_of_a_bridge_is_one_burst_on_neighbouring_channels(rig: Rig) -> None:
    bridge = HBridge(rig.bring_up(), 8, 9, 10)
    bridge.forward(0.5)
    bridge.reverse(0.5)
    bridge.brake()
    bridge.coast()
    bridge.off()
    assert rig.sent() == [
        f"W 26 {HALF} {ON} {OFF}",
        f"W 26 {HALF} {OFF} {ON}",
        f"W 26 {ON} {ON} {ON}",
        f"W 26 {ON} {OFF} {OFF}",
        f"W 26 {OFF} {OFF} {OFF}",
    ]


@pytest.mark.parametrize(
    ("channels", "sent"),
    [
        ((13, 11, 12), [f"W 32 {ON} {OFF} {HALF}"]),
        ((7, 5, 6), [f"W 1a {ON} {OFF} {HALF}"]),
        ((2, 4, 3), [f"W 0e {HALF} {OFF} {ON}"]),
        ((1, 2, 0), [f"W 06 {OFF} {HALF} {ON}"]),
        # apart, the PWM is off while the inputs change
        ((0, 4, 8), [f"W 06 {OFF}", f"W 16 {ON}", f"W 26 {OFF}", f"W 06 {HALF}"]),
    ],
)
def test_channels_of_a_bridge_may_stand_in_any_order(
    rig: Rig, channels: tuple[int, int, int], sent: list[str]
) -> None:
    HBridge(rig.bring_up(), *channels).forward(0.5)
    assert rig.sent() == sent


@pytest.mark.parametrize("duty", [-0.1, 1.1])
def test_a_duty_that_is_none_is_refused_as_is_any_before_bring_up_and_nothing_is_sent(
    rig: Rig, duty: float
) -> None:
    bridge = HBridge(rig.driver, 8, 9, 10)
    with pytest.raises(NotReady, match="duties before bring-up"):
        bridge.forward(0.5)
    rig.bring_up()
    with pytest.raises(ValueError, match="expected 0 to 1"):
        bridge.forward(duty)
    assert rig.sent() == []


@pytest.mark.parametrize("channels", [(8, 8, 9), (14, 15, 16), (-1, 0, 1)])
def test_channels_that_cannot_be_are_refused(rig: Rig, channels: tuple[int, int, int]) -> None:
    with pytest.raises(SettingError, match="expected three different channels from 0 to 15"):
        HBridge(rig.driver, *channels)


# What may not share -------------------------------------------------------------------------------


USERS: dict[str, Callable[[Pca9685], object]] = {
    "head": lambda on: Servos("head", on, servos_settings(PAN)),
    "fan": lambda on: Esc("fan", on, EscSettings(3, 50.0, 1000.0, 2000.0, 0)),
    "thrust": lambda on: ThrustPairs(
        "thrust", on, ThrustSettings(0.4, 1000.0, 100.0, 50 * MILLISECOND, 8)
    ),
    "bridge": lambda on: HBridge(on, 8, 9, 10),
    "other bridge": lambda on: HBridge(on, 13, 11, 12),
}


def chip() -> Pca9685:
    return Pca9685(I2cBusDouble("i2c1", lambda: 0, []))


@pytest.mark.parametrize(
    ("first", "second", "alone"),
    [
        ("head", "fan", "fan"),
        ("fan", "head", "head"),
        ("fan", "thrust", "thrust"),
        ("head", "bridge", "head"),
        ("bridge", "fan", "fan"),
    ],
)
def test_two_of_which_one_would_switch_the_other_off_are_refused(
    first: str, second: str, alone: str
) -> None:
    shared = chip()
    USERS[first](shared)
    with pytest.raises(SettingError, match=f"i2c1: {alone} turns all outputs off"):
        USERS[second](shared)
    USERS[second](chip())


def test_bridges_share_a_chip() -> None:
    shared = chip()
    USERS["bridge"](shared)
    USERS["other bridge"](shared)
