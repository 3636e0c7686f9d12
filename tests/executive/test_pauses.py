"""A run that pauses: nothing of it passes meanwhile, and nothing of it ends."""

from pathlib import Path

import pytest

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.statistics import file_header
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import HEARTBEAT
from firmware_runtime.statistics.reader import read_statistics
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Actuator, Robot
from tests.support.stalling_clock import StallingClock


def test_outputs_are_made_safe_at_the_end_only() -> None:
    run = Run(Robot(), VirtualClock())
    run.executive.run_on(2 * PERIOD)
    assert (run.made_safe, run.executive.is_over) == (0, False)
    ended = run.executive.end()
    assert ended is not None
    assert ended.state is RunState.ENDED
    assert (run.made_safe, run.executive.is_over) == (2, True)


def test_ending_what_is_over_or_never_began_does_nothing() -> None:
    run = Run(Robot(), VirtualClock())
    assert run.executive.end() is None
    run.until(PERIOD)
    assert run.executive.end() is None
    assert run.made_safe == 2


def test_a_run_that_was_stopped_has_ended_and_does_not_go_on() -> None:
    robot = Robot()
    run = Run(robot, VirtualClock())
    robot.imu.work = lambda _number: run.executive.request_stop("enough")
    assert run.executive.run_on(2 * PERIOD).state is RunState.STOPPED
    assert run.made_safe == 2
    with pytest.raises(RuntimeError):
        run.executive.run_on(3 * PERIOD)


def test_time_that_passes_in_a_pause_is_none_of_the_run() -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock)
    run.executive.run_on(2 * PERIOD)
    clock.instant += SECOND
    run.executive.run_on(4 * PERIOD)
    run.executive.end()
    assert robot.thrust.received == [0, 1, 2, 3, 4]
    assert run.counts("imu") == (5, 5, 0, 0)
    assert run.executive.reached == 4 * PERIOD


def test_nothing_falls_due_in_a_pause(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    path = tmp_path / "robot.stats"
    run = Run(Robot(), StallingClock(), Configuration(statistics_path=path))
    run.executive.run_on(2 * PERIOD)
    monkeypatch.setattr(file_header, "monotonic_ns", lambda: NEVER // 2)
    assert read_statistics(path).figures().scheduled == run.executive.statistics.figures().run
    assert run.executive.cells[HEARTBEAT] == 0


def test_virtual_time_that_has_nothing_to_wait_for_goes_on_with_an_input() -> None:
    model = Actuator("thrust")
    executive = Executive(model, VirtualClock())
    executive.run_on(NEVER)
    executive.plan(SECOND, model.command, 1)
    executive.run_on(NEVER)
    assert (model.received, executive.reached) == ([1], SECOND)


def test_what_is_planned_comes_before_what_arrives_at_the_same_instant() -> None:
    model, clock = Actuator("thrust"), StallingClock()
    executive = Executive(model, clock)
    clock.at(PERIOD, lambda: executive.inbox.post(model.command, 2))
    executive.plan(PERIOD, model.command, 1)
    executive.plan(2 * PERIOD, model.command, 3)
    executive.run(3 * PERIOD)
    assert model.received == [1, 2, 3]


def test_an_instant_that_has_passed_is_now() -> None:
    model = Actuator("thrust")
    executive = Executive(model, VirtualClock())
    executive.run_on(2 * PERIOD)
    executive.plan(PERIOD, model.command, 1)
    executive.run_on(3 * PERIOD)
    assert model.received == [1]
