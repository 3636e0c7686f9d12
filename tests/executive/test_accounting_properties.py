"""The accounts hold for any stall at any tick, and where no clock is read in a step."""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import accumulate, count, takewhile

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.executive.clocks import Clock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.statistics.layout import MODEL, STEP_HISTOGRAM, STEPS
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot, Sampler
from tests.support.stalling_clock import StallingClock

UNTIL = 60 * PERIOD
SPANS = st.integers(0, 12 * PERIOD) | st.sampled_from([PERIOD - 1, PERIOD, PERIOD + 1, 1])
STALLS = st.dictionaries(st.integers(0, 40), SPANS, max_size=8)
WORKS = st.dictionaries(st.integers(0, 40), st.integers(0, 4 * PERIOD), max_size=8)


@dataclass
class Expected:
    """One periodic model, alone, by arithmetic on numbers of periods."""

    stalls: dict[int, int]
    works: dict[int, int]
    catch_up: bool
    late: list[tuple[int, int]] = field(default_factory=list)
    run: int = 0
    skipped: int = 0
    episodes: int = 0

    def __post_init__(self) -> None:
        number, now, troubled = 0, 0, False
        while number * PERIOD <= UNTIL:
            started = max(now, number * PERIOD) + self.stalls.get(self.run, 0)
            lateness = started - number * PERIOD
            now = started + self.works.get(self.run, 0)
            self.run += 1
            following = number + 1
            if not self.catch_up:
                following = max(following, min(-(-now // PERIOD), UNTIL // PERIOD + 1))
            missed = following - number - 1
            was_troubled, troubled = troubled, lateness > PERIOD // 10
            if troubled:
                self.late.append((number * PERIOD, lateness))
                self.episodes += not was_troubled
            if missed > 0:
                self.skipped += missed
                self.episodes += not troubled
                troubled = True
            number = following


@pytest.mark.slow
@pytest.mark.parametrize("policy", ["skip", "catch-up"])
@given(stalls=STALLS, works=WORKS)
def test_counts_and_episodes_equal_the_arithmetic(
    policy: str, stalls: dict[int, int], works: dict[int, int]
) -> None:
    robot, clock = Robot(), StallingClock(stalls)
    robot.imu.work = lambda number: clock.spend(works.get(number, 0))
    policies = {"imu": ActivationPolicy(policy)}  # type: ignore[arg-type]
    run = Run(robot, clock, Configuration(policies=policies))
    run.until(UNTIL)
    expected = Expected(stalls, works, catch_up=policy == "catch-up")
    imu = run.model("imu")
    assert imu["scheduled"] == 61
    assert run.counts("imu")[1:] == (expected.run, expected.skipped, 0)
    assert (imu["overruns"], imu["episodes"]) == (len(expected.late), expected.episodes)
    assert imu["last_late_t_ns"] == (expected.late[-1][0] if expected.late else None)


@pytest.mark.slow
@given(tick=st.integers(0, 59), stall=st.integers(1, 400 * MILLISECOND))
def test_one_stall_of_any_length_at_any_tick_is_closed_form(tick: int, stall: int) -> None:
    run = Run(Robot(), StallingClock({tick: stall}))
    run.until(UNTIL)
    missed = min(-(-stall // PERIOD) - 1, 60 - tick)
    late = int(stall > PERIOD // 10)
    imu = run.model("imu")
    assert run.counts("imu") == (61, 61 - missed, missed, 0)
    assert (imu["overruns"], imu["episodes"]) == (late, late)
    assert imu["lateness_us"]["max"] == stall / 1000


@pytest.mark.slow
@settings(max_examples=50)
@given(
    stalls=STALLS,
    periods=st.tuples(*[st.integers(2 * MILLISECOND, 5 * PERIOD)] * 2),
    policy=st.sampled_from(["skip", "catch-up", "stop"]),
    replans=st.lists(st.tuples(st.integers(0, UNTIL), st.integers(1, 3 * PERIOD)), max_size=10),
    works=WORKS,
)
def test_every_activation_ends_as_run_skipped_or_coalesced_at_every_instant(
    stalls: dict[int, int],
    periods: tuple[int, int],
    policy: str,
    replans: list[tuple[int, int]],
    works: dict[int, int],
) -> None:
    robot, clock = Robot(*periods), StallingClock(stalls)
    limit = 30_000 if policy == "stop" else None
    policies = {"imu": ActivationPolicy(policy, stop_after_us=limit)}  # type: ignore[arg-type]
    run = Run(robot, clock, Configuration(policies=policies))

    def replan(delay: int) -> Callable[[], object]:
        return lambda: run.executive.inbox.post(robot.replan, delay)

    def work(number: int) -> None:
        clock.spend(works.get(number, 0))
        assert_identity(run, "imu", "compass")

    robot.thrust.work = work
    for at, delay in sorted(replans):
        clock.at(at, replan(delay))
    assert run.until(UNTIL).error is None
    assert_identity(run, "imu", "compass")
    assert run.counts("imu")[1] == robot.imu.activations
    assert run.counts("compass")[1] == robot.compass.activations
    both = zip(run.counts("imu"), run.counts("compass"), strict=True)
    assert run.counts() == tuple(map(sum, both))


def assert_identity(run: Run, *paths: str) -> None:
    for path in paths:
        scheduled, executed, skipped, coalesced = run.counts(path)
        assert scheduled == executed + skipped + coalesced


@pytest.mark.slow
def test_after_a_million_periods_no_activation_has_drifted() -> None:
    period, first, until = 9_999_991, 3, 1_000_000
    sampler, clock = Sampler("imu", period, first), StallingClock()
    sampler.work = lambda number: clock.spend(period * (number % 200))
    run = Run(sampler, clock)
    instants: list[int] = []
    run.executive.simulator.listen(sampler.sample, lambda at, _number: instants.append(at))
    run.until(first + until * period)
    steps = (max(number % 200, 1) for number in count())
    numbers = list(takewhile(lambda number: number <= until, accumulate(steps, initial=0)))
    assert len(numbers) > 10_000
    assert instants == [first + number * period for number in numbers]
    assert run.counts() == (until + 1, len(numbers), until + 1 - len(numbers), 0)


TIME_ADVANCES = (0, MILLISECOND, 2 * MILLISECOND, 5 * MILLISECOND, NEVER)
NO_SPAN = -1
"""A time advance that is refused."""
FAILURE = -2
"""In the place of a span: the model raises an error."""
plans = st.lists(st.sampled_from(TIME_ADVANCES), min_size=1, max_size=30)
ends = st.sampled_from([NEVER, NO_SPAN, FAILURE])
periods = st.sampled_from([NEVER, MILLISECOND, 5 * MILLISECOND])


class Planned(Atomic):
    """Holds for one span of a plan after the other, whatever happens; passive at its end."""

    def __init__(self, name: str, plan: list[int], period: int) -> None:
        super().__init__(name)
        self.period = period
        self.into = self.in_port("into", int)
        self.out = self.out_port("out", int)
        self._plan = iter(plan)

    def initialize(self) -> None:
        self.internal()

    def output(self) -> None:
        self.out.send(1)

    def internal(self) -> None:
        span = next(self._plan, NEVER)
        if span == FAILURE:
            raise ZeroDivisionError
        self.hold_in("waiting", span)

    def external(self, elapsed: int) -> None:  # noqa: ARG002 -- any input moves it on
        self.internal()


def counted(
    clock: Clock, one: list[int], other: list[int], period: int = NEVER
) -> tuple[list[list[int]], bool]:
    """Every cell of two models that move each other on, and whether no clock was read in a step.

    The first one has the period.
    """
    root = Coupled("root")
    first = root.add(Planned("first", [MILLISECOND, *one], period))
    second = root.add(Planned("second", [MILLISECOND, *other], NEVER))
    root.couple(first.out, second.into)
    root.couple(second.out, first.into)
    run = Run(root, clock)
    run.until(100 * MILLISECOND)
    file = run.executive._ledger.file
    blocks = [file.layout.lateness, file.layout.step]
    cells = [list(file.cells[block(index)]) for block in blocks for index in (0, 1)]
    begins = [file.layout.model(index) for index in (0, 1)]
    cells += [list(file.cells[begin : begin + len(MODEL)]) for begin in begins]
    cells.append([*file.cells[STEPS : STEPS + 1], *file.cells[STEP_HISTOGRAM]])
    return cells, run.executive._profiler.step.stands_still


@pytest.mark.slow
@settings(max_examples=50)
@given(plans, plans, ends, periods)
def test_it_counts_the_same_as_where_functions_may_take_time(
    one: list[int], other: list[int], end: int, period: int
) -> None:
    untimed, is_untimed = counted(VirtualClock(), one, [*other, end], period)
    timed, is_timed = counted(StallingClock(), one, [*other, end], period)
    assert (is_untimed, is_timed) == (True, False)
    assert untimed == timed
