"""At the end of a run outputs are switched off until that works, for a stated while at most."""

import os
import signal
from collections.abc import Callable, Sequence
from typing import NoReturn

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import Clock, MonotonicClock, S, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import OFF_AGAIN_EVERY, Outcome
from firmware_runtime.hal.wire_errors import NoAcknowledge
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import ELAPSED, HEARTBEAT, STATE, WRITTEN
from firmware_runtime.system.signals import stop_on_signals
from tests.support.periodic_models import PERIOD, Actuator, Robot

SILENT = "i2c1 0x40: no acknowledge"


class Outputs:
    """Outputs that cannot be switched off before an instant of the world; `tries` are instants."""

    def __init__(self, back_at: int, clock: Clock | None = None, span: int = SECOND) -> None:
        self.back_at = back_at
        self.tries: list[int] = []
        self.during: Callable[[], None] = lambda: None
        configuration = Configuration(switch_off_for=span)
        self.thrust = Actuator("thrust")
        self.executive = Executive(
            self.thrust, clock or VirtualClock(), self._make_safe, configuration
        )

    def run(self) -> Outcome:
        return self.executive.run(PERIOD)

    def _make_safe(self) -> list[str]:
        now = self.executive.world_now()
        self.tries.append(now)
        self.during()
        return [SILENT] if now < self.back_at else []


def test_an_outage_shorter_than_the_stated_while_leaves_nothing_on() -> None:
    outputs = Outputs(back_at=PERIOD + 300 * MILLISECOND)
    assert outputs.run().faults == ()
    *tries, after_exit = outputs.tries
    assert tries[-1] == after_exit == PERIOD + 300 * MILLISECOND
    assert tries[1:] == [PERIOD + each * OFF_AGAIN_EVERY for each in range(1, len(tries))]
    assert outputs.thrust.exits == 1


def test_after_the_stated_while_it_is_given_up_and_said_so() -> None:
    outputs = Outputs(back_at=10 * SECOND, span=200 * MILLISECOND)
    first, last = outputs.run().faults
    assert first == SILENT
    assert "11 attempts in 0.20 s" in last
    assert len(outputs.tries) == 11
    assert outputs.thrust.exits == 1


def test_without_a_while_it_is_tried_once() -> None:
    outputs = Outputs(back_at=10 * SECOND, span=0)
    assert outputs.run().faults == (SILENT,)
    assert len(outputs.tries) == 1


def test_what_could_not_be_switched_off_is_tried_again_where_an_exit_failed() -> None:
    outputs = Outputs(back_at=PERIOD + 150 * MILLISECOND, span=100 * MILLISECOND)

    def leave() -> NoReturn:
        raise OSError("line held")

    outputs.thrust.exit = leave  # type: ignore[method-assign]
    (fault,) = outputs.run().faults
    assert "line held" in fault


def test_a_clock_that_stands_still_keeps_no_run_from_ending() -> None:
    class Still(VirtualClock):
        def wait(self, until: int, sources: Sequence[S]) -> list[S]:
            return super().wait(min(until, PERIOD), sources)

    outputs = Outputs(back_at=10 * SECOND, clock=Still())
    assert outputs.run().faults[0] == SILENT


def test_meanwhile_it_shows_no_sign_of_life_so_that_the_guard_tries_too() -> None:
    outputs = Outputs(back_at=PERIOD + 100 * MILLISECOND)
    heartbeats: list[int] = []
    states: set[int] = set()

    def look() -> None:
        heartbeats.append(outputs.executive.cells[HEARTBEAT])
        states.add(outputs.executive.cells[STATE])

    outputs.during = look
    outputs.run()
    assert states == {RunState.RUNNING}  # a guard leaves alone what has ended
    assert len(heartbeats) > 1
    assert len(set(heartbeats)) == 1
    assert outputs.executive.cells[WRITTEN] > 0
    assert outputs.executive.cells[ELAPSED] == PERIOD


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_meanwhile_keeps_nothing_from_being_switched_off(number: signal.Signals) -> None:
    outputs = Outputs(back_at=PERIOD + 300 * MILLISECOND)
    signals = iter([number])
    outputs.during = lambda: _send(next(signals, None))
    executive = outputs.executive
    with stop_on_signals(executive.request_stop, give_up=executive.give_up):
        outcome = outputs.run()
    assert (outcome.state, outcome.faults) == (RunState.ENDED, ())


def test_a_second_ctrl_c_gives_up() -> None:
    outputs = Outputs(back_at=10 * SECOND)
    signals = iter([signal.SIGINT, None, signal.SIGINT])
    outputs.during = lambda: _send(next(signals))
    executive = outputs.executive
    with stop_on_signals(executive.request_stop, give_up=executive.give_up):
        faults = outputs.run().faults
    assert len(outputs.tries) == 3
    assert faults[0] == SILENT


def test_ctrl_c_without_a_handler_of_ours_gives_up_too() -> None:
    outputs = Outputs(back_at=10 * SECOND, clock=RaisingClock(KeyboardInterrupt()))
    outcome = outputs.run()
    assert outcome.state is RunState.STOPPED
    assert len(outputs.tries) <= 2
    assert outputs.thrust.exits == 1


def test_in_real_time_the_bus_is_waited_for_too() -> None:
    outputs = Outputs(
        back_at=2 * PERIOD + 50 * MILLISECOND, clock=MonotonicClock(), span=30 * SECOND
    )
    assert outputs.run().faults == ()
    assert len(outputs.tries) > 1


def test_a_run_over_before_its_time_switches_off_again_too() -> None:
    """Virtual time in which nothing is due goes on to never; the world must not."""
    outputs = Outputs(back_at=100 * MILLISECOND)
    assert outputs.executive.run().faults == ()
    assert outputs.tries[-1] == 100 * MILLISECOND


@pytest.mark.parametrize(("back_at", "faults"), [(0, 0), (10 * SECOND, 2)])
def test_an_exit_that_fails_on_its_bus_counts_only_if_outputs_stay_on(
    back_at: int, faults: int
) -> None:
    outputs = Outputs(back_at)

    def gone() -> NoReturn:
        raise NoAcknowledge(SILENT)

    setattr(outputs.thrust, "exit", gone)  # noqa: B010 -- a function in place of a method
    assert len(outputs.run().faults) == faults


class RaisingClock(VirtualClock):
    """A clock whose wait ends in an error."""

    def __init__(self, error: BaseException) -> None:
        super().__init__()
        self._error = error

    def wait(self, until: int, sources: object) -> NoReturn:  # noqa: ARG002
        raise self._error


class Unprintable(RuntimeError):
    """An error whose text cannot be had, on pain of `worse`."""

    worse: BaseException = ValueError("no words")

    def __str__(self) -> str:
        raise self.worse


class Deadly(Unprintable):
    """One whose text would end the interpreter."""

    worse = SystemExit(0)


@pytest.mark.parametrize("kind", [Unprintable, Deadly])
def test_an_error_that_cannot_be_printed_leaves_nothing_on(kind: type[Unprintable]) -> None:
    made_safe: list[int] = []

    def make_safe() -> list[str]:
        made_safe.append(1)
        return []

    def work(_number: int) -> NoReturn:
        raise kind

    robot = Robot()
    robot.imu.work = work
    outcome = Executive(robot, VirtualClock(), make_safe).run()
    assert outcome.state is RunState.FAILED
    assert kind.__name__ in outcome.reason
    assert (len(made_safe), robot.thrust.exits) == (2, 1)


def test_an_unprintable_error_outside_every_model_leaves_nothing_on() -> None:
    outputs = Outputs(back_at=0, clock=RaisingClock(Unprintable()))
    outcome = outputs.run()
    assert outcome.state is RunState.FAILED
    assert "Unprintable" in outcome.reason
    assert (len(outputs.tries), outputs.thrust.exits) == (2, 1)


def test_an_unprintable_error_in_making_safe_and_in_exit_is_reported() -> None:
    def make_safe() -> NoReturn:
        raise Unprintable

    class Stubborn(Actuator):
        def exit(self) -> None:
            raise Unprintable

    outcome = Executive(Stubborn("thrust"), VirtualClock(), make_safe).run(PERIOD)
    assert all("Unprintable" in fault for fault in (outcome.faults[0], outcome.faults[-1]))


def _send(number: signal.Signals | None) -> None:
    if number is not None:
        os.kill(os.getpid(), number)
