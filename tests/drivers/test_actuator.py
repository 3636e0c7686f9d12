"""The base of all that moves something: stop again, bring-up again, interlock, polling."""

from collections.abc import Callable

import pytest
from firmware_drivers.actuator import POLL_EVERY, STOP_AGAIN_AFTER, Actuator
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.step import Step
from firmware_drivers.esc import Esc, EscSettings

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.interlock import POLL_PERIOD
from firmware_runtime.hal.wire_errors import HalError, NoAcknowledge, NotReady
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.atomic_bench import AtomicBench
from tests.support.scripted_chip import SILENT, ScriptedChip

RESET = NotReady("scripted chip: it was reset")
STOP_AGAIN_MS = STOP_AGAIN_AFTER / MILLISECOND
POLL_MS = POLL_EVERY / MILLISECOND


class Valve(Actuator):
    """Open or shut; polls its chip whenever it is commanded and has been open for long enough."""

    def __init__(self, chip: ScriptedChip, interlock: Callable[[], bool]) -> None:
        steps = (Step("identify", lambda: chip.answer("step", [None]), 0),)
        super().__init__("valve", lambda: steps, chip.line, interlock)
        self.open_to = self.in_port("open_to", float)
        self.chip = chip
        self.writes: list[HalError | None] = [None]
        self.stops: list[HalError | None] = [None]
        self.polls: list[HalError | None] = [None]

    def external(self, elapsed: int) -> None:
        self.since_poll += elapsed
        try:
            self.chip.answer("write", self.writes)
            self.poll_if_due()
        except HalError as error:
            self.fail(error)
        else:
            self.note_success()
            self.activate("opening")

    def drive_on(self) -> None:
        if self.phase == "opening" and not self.interlock():
            self.disable()
        else:
            self.settle()

    def settle(self) -> None:
        self.passivate("resting")

    def resume(self) -> None:
        self.activate("opening")

    def poll(self) -> None:
        self.chip.answer("poll", self.polls)

    def write_stop(self) -> None:
        self.chip.answer("stop", self.stops)


class Rig(AtomicBench):
    """A valve on a chip that answers as scripted."""

    def __init__(self) -> None:
        self.chip = ScriptedChip()
        self.enabled = True
        self.valve = Valve(self.chip, lambda: self.enabled)
        super().__init__(self.valve)
        self.chip.now = lambda: self.simulator.now


@pytest.fixture
def rig() -> Rig:
    return Rig()


def test_a_command_that_fails_ends_in_a_stop_at_once(rig: Rig) -> None:
    rig.valve.writes = [SILENT]
    rig.put(10, open_to=1.0)
    assert rig.chip.times("stop") == [10]
    assert [(fault.kind, fault.consecutive) for fault in rig.faults] == [("NoAcknowledge", 1)]


def test_a_stop_is_written_again_at_one_pace_until_it_is_acknowledged(rig: Rig) -> None:
    rig.valve.writes = [SILENT]
    rig.valve.stops = [SILENT, SILENT, None]
    rig.put(10, open_to=1.0)
    rig.run(1000)
    assert rig.chip.times("stop") == [10, 10 + STOP_AGAIN_MS, 10 + 2 * STOP_AGAIN_MS]
    assert (len(rig.faults), rig.valve.phase) == (3, "resting")


def test_a_chip_that_is_only_silent_is_not_brought_up_again(rig: Rig) -> None:
    rig.valve.writes = [SILENT]
    rig.put(10, open_to=1.0)
    rig.run(1000)
    assert rig.chip.times("step") == [0]


def test_a_chip_that_was_reset_is_brought_up_once_the_stop_is_acknowledged(rig: Rig) -> None:
    rig.valve.writes = [RESET]
    rig.valve.stops = [SILENT, None]
    rig.put(10, open_to=1.0)
    rig.run(1000)
    assert rig.chip.times("step") == [0, 10 + STOP_AGAIN_MS]
    assert rig.valve.unready() is None


def test_a_chip_is_polled_once_it_has_driven_for_long_enough(rig: Rig) -> None:
    for at_ms in (10, POLL_MS - 10, POLL_MS + 10, 2 * POLL_MS - 10, 2 * POLL_MS + 20):
        rig.put(at_ms, open_to=1.0)
        rig.run(at_ms)
    assert rig.chip.times("poll") == [POLL_MS + 10, 2 * POLL_MS + 20]


def test_the_command_after_a_failed_one_is_followed_by_a_poll(rig: Rig) -> None:
    rig.valve.writes = [SILENT, None]
    rig.put(10, open_to=1.0)
    rig.put(20, open_to=1.0)
    assert rig.chip.times("poll") == [20]


def test_an_acknowledged_command_ends_the_repetition_of_a_stop(rig: Rig) -> None:
    rig.valve.writes, rig.valve.stops = [SILENT, None], [SILENT]
    rig.put(10, open_to=1.0)
    rig.put(20, open_to=1.0)
    rig.run(1000)
    assert rig.chip.times("stop") == [10]
    assert rig.valve.unready() is None


def test_a_chip_that_failed_keeps_outputs_disabled_until_it_acknowledges_a_stop(rig: Rig) -> None:
    """While they are disabled nothing else is written, so nothing else could show that it works."""
    rig.valve.writes, rig.valve.stops = [SILENT], [SILENT, None]
    rig.put(10, open_to=1.0)
    assert rig.valve.unready() == "has failed 2 times in a row"
    rig.run(10 + STOP_AGAIN_MS)
    assert rig.valve.unready() is None


def test_a_disabled_actuator_is_stopped_once_and_resumes_when_the_interlock_lets_it(
    rig: Rig,
) -> None:
    rig.enabled = False
    rig.put(10, open_to=1.0)
    rig.run(200)
    assert (rig.chip.times("stop"), rig.valve.phase) == ([10], "disabled")
    rig.enabled = True
    rig.run(200 + POLL_PERIOD / MILLISECOND)
    assert (rig.chip.times("stop"), rig.valve.phase) == ([10], "resting")


def test_an_exit_stops_whatever_the_phase(rig: Rig) -> None:
    rig.run(0)
    assert rig.simulator.exit() == []
    assert len(rig.chip.times("stop")) == 1


def test_an_esc_whose_low_pulse_is_lost_is_switched_off_all_the_same() -> None:
    double = Pca9685Double(lambda: 0)
    bus = I2cBusDouble("i2c1", lambda: 0, [double])
    settings = EscSettings(
        channel=3, frequency_hz=50.0, low_pulse_us=1000.0, high_pulse_us=2000.0, arming=SECOND
    )
    esc = Esc("esc", Pca9685(bus), settings)
    bench = AtomicBench(esc)
    bench.put(1000, arm=True)
    bus.faults = FaultScript([NackAddress(times=1)])
    with pytest.raises(NoAcknowledge):
        esc.write_stop()
    assert double.all_off
