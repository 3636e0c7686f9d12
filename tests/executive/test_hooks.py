"""Hooks: called before each wait, with the time that is left to the next event."""

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.policy import ActivationPolicy
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot
from tests.support.stalling_clock import StallingClock


class Diary:
    """A hook that keeps when it was called, and what time it was given."""

    def __init__(self, run: Run) -> None:
        self.calls: list[tuple[int, int]] = []
        run.executive.hooks.append(self)

    def between_steps(self, now: int, left: int) -> None:
        self.calls.append((now, left))


def test_they_are_called_before_each_wait_with_the_time_to_the_next_event() -> None:
    run = Run(Robot(), VirtualClock())
    diary = Diary(run)
    run.until(3 * PERIOD)
    assert diary.calls[:4] == [(0, 0), (0, PERIOD), (PERIOD, PERIOD), (2 * PERIOD, PERIOD)]


def test_what_a_step_took_is_not_left() -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock)
    diary = Diary(run)
    robot.imu.work = lambda _number: clock.spend(4 * MILLISECOND)
    run.until(PERIOD)
    assert diary.calls[1] == (4 * MILLISECOND, PERIOD - 4 * MILLISECOND)


def test_a_late_loop_has_nothing_left_and_calls_them_all_the_same() -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock, Configuration(policies={"imu": ActivationPolicy("catch-up")}))
    first, second = Diary(run), Diary(run)
    robot.imu.work = lambda number: clock.spend(PERIOD + 1) if number == 1 else None
    run.until(3 * PERIOD)
    assert (2 * PERIOD + 1, -1) in first.calls
    assert first.calls == second.calls


def test_the_end_of_the_run_is_no_less_near_than_an_event() -> None:
    run = Run(Robot(), VirtualClock())
    diary = Diary(run)
    run.until(PERIOD + 1)
    assert diary.calls[-1] == (PERIOD, 1)


class Prompt(Diary):
    """A hook that is to be called at an instant between two steps, once."""

    def between_steps(self, now: int, left: int) -> None:
        super().between_steps(now, left)
        if now < PERIOD // 2:
            self.run.executive.poll_by(PERIOD // 2)

    def __init__(self, run: Run) -> None:
        super().__init__(run)
        self.run = run


def test_a_hook_is_called_at_the_instant_it_asked_for_and_no_step_is_made_there() -> None:
    run = Run(Robot(), VirtualClock())
    prompt, other = Prompt(run), Diary(run)
    run.until(PERIOD)
    asked_for = (PERIOD // 2, PERIOD - PERIOD // 2)
    assert prompt.calls == other.calls == [(0, 0), (0, PERIOD), asked_for, (PERIOD, 0)]


class Offered:
    """What time garbage may be collected in, where the run would have it so."""

    def __init__(self) -> None:
        self.lefts: list[int] = []

    def offer(self, left: int) -> None:
        self.lefts.append(left)


def test_garbage_is_collected_before_the_instant_that_a_hook_asked_for() -> None:
    run, offered = Run(Robot(), VirtualClock()), Offered()
    Prompt(run)
    run.executive._loop.collector = offered  # type: ignore[assignment]
    run.until(PERIOD)
    assert offered.lefts == [0, PERIOD // 2, PERIOD // 2, 0]
