"""The base of all that moves something: stop again, bring-up again, interlock, polling."""

import math
from collections.abc import Callable

import pytest
from firmware_drivers.actuator import Actuator
from firmware_drivers.chips.step import Step
from firmware_drivers.output_state import OutputState

from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.hal.interlock import POLL_PERIOD, always_enabled, poll_period
from firmware_runtime.hal.wire_errors import HalError, NoAcknowledge, NotReady
from tests.support.pca9685_bench import esc_bench
from tests.support.scripted_bench import PlayedBench
from tests.support.scripted_chip import SILENT, ScriptedChip
from tests.support.wire import sentences

RESET = NotReady("scripted chip: it was reset")


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


class Rig(PlayedBench):
    """A valve on a chip that answers as scripted."""

    def __init__(self) -> None:
        self.chip = ScriptedChip()
        self.enabled = True
        self.valve = Valve(self.chip, lambda: self.enabled)
        super().__init__(self.valve)
        self.chip.now = lambda: self.simulator.now

    def act(self, line: str) -> None:
        """Script what the chip answers: well, `x` not at all, `r` that it was reset."""
        kind, answers = line.split()
        script = [{".": None, "x": SILENT, "r": RESET}[each] for each in answers]
        setattr(self.valve, kind, script)

    @property
    def stopped(self) -> list[float]:
        return self.chip.times("stop")

    @property
    def polled(self) -> list[float]:
        return self.chip.times("poll")

    @property
    def steps(self) -> list[float]:
        return self.chip.times("step")

    @property
    def unready(self) -> str:
        return self.valve.unready() or ""


@pytest.fixture
def rig() -> Rig:
    return Rig()


ORDER = "10 open_to=1.0"


@sentences(
    {
        "a command that fails ends in a stop at once": (
            f"writes x; {ORDER}; 1000; stopped is 10; steps is 0; consecutive is 1; unready is ()"
        ),
        # at one pace
        "a stop is written again until it is acknowledged": (
            f"writes x; stops xx.; {ORDER}; 1000; stopped is 10 60 110; steps is 0; "
            "consecutive is 1 2 3; phase is resting"
        ),
        "a chip that was reset is brought up once the stop is acknowledged": (
            f"writes r; stops x.; {ORDER}; 1000; stopped is 10 60; steps is 0 60; unready is ()"
        ),
        "the command after a failed one is followed by a poll, and ends the repetition of a stop": (
            f"writes x.; stops x; {ORDER}; 20 open_to=1.0; 1000; stopped is 10; polled is 20; "
            "unready is ()"
        ),
        # nothing else is written while they are disabled, so nothing else could show that it works
        "a chip that failed keeps outputs disabled until it acknowledges a stop": (
            f"writes x; stops x.; {ORDER}; unready is has failed 2 times in a row; 60; "
            "unready is ()"
        ),
        "a chip is polled once it has driven for long enough": (
            "10 open_to=1; 990 open_to=1; 1010 open_to=1; 1990 open_to=1; 2020 open_to=1; "
            "polled is 1010 2020"
        ),
    }
)
def test_commands_stops_and_polls(rig: Rig, lines: str) -> None:
    rig.play(lines)


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
    assert (poll_period(lambda: True), poll_period(always_enabled)) == (POLL_PERIOD, NEVER)


def test_a_refused_command_does_not_change_how_often_the_interlock_is_checked() -> None:
    bench = esc_bench(enabled=False)
    bench.put(100, arm=True)
    bench.put(100 + 0.7 * POLL_PERIOD / MILLISECOND, throttle=math.nan)
    bench.run(1000)
    assert (bench.model.phase, bench.model.sigma) == ("disabled", POLL_PERIOD)


def test_an_exit_stops_whatever_the_phase(rig: Rig) -> None:
    rig.run(0)
    assert rig.simulator.exit() == []
    assert len(rig.chip.times("stop")) == 1


def test_an_esc_whose_low_pulse_is_lost_is_switched_off_all_the_same() -> None:
    bench = esc_bench()
    bench.put(1000, arm=True)
    bench.refuse(1)
    assert isinstance(bench.actuator, Actuator)
    with pytest.raises(NoAcknowledge):
        bench.actuator.write_stop()
    assert bench.double.all_off


def test_it_says_at_first_how_it_is_and_then_what_changes() -> None:
    enabled = {"now": False}
    model = OutputState("outputs", lambda: enabled["now"])
    said: list[tuple[int, int]] = []
    simulator = Simulator(model)
    simulator.listen(model.enabled, lambda at, value: said.append((at, value)))
    for at, is_enabled in ((0, False), (50, True), (100, True), (150, False), (200, False)):
        enabled["now"] = is_enabled
        while simulator.next_at <= at * MILLISECOND:
            simulator.advance(simulator.next_at)
    assert [value for _, value in said] == [0, 1, 0]
    assert said[0][0] == 0
    assert said[1][0] <= 70 * MILLISECOND
    assert said[2][0] <= 170 * MILLISECOND
