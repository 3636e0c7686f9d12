"""The accounts hold for any stall at any tick: compared with arithmetic written down on its own."""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import accumulate, count, takewhile

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.policy import ActivationPolicy
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot, Sampler
from tests.support.stalling_clock import StallingClock

pytestmark = pytest.mark.slow

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


@settings(deadline=None)
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
