"""Clocks: what they count and when their waits end, never how exactly."""

import os
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.executive import clocks
from firmware_runtime.executive.clocks import (
    FURTHEST_AHEAD,
    MonotonicClock,
    OutsideClock,
    ScaledClock,
    VirtualClock,
    WorldClock,
)
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.system import c_library
from sim_doubles.clock import ManualClock
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot
from tests.support.stalling_clock import StallingClock


class Bell:
    """A source that is readable once rung."""

    def __init__(self) -> None:
        self.descriptor = os.eventfd(0)

    def fileno(self) -> int:
        return self.descriptor

    def ring(self) -> None:
        os.eventfd_write(self.descriptor, 1)


@pytest.fixture
def bell() -> Iterator[Bell]:
    made = Bell()
    yield made
    os.close(made.descriptor)


class Hardware:
    """Stands in for CLOCK_MONOTONIC, for select and for the alarm."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.instant = 5 * SECOND
        self.reading = 0
        self.alarms: list[int] = []
        monkeypatch.setattr(clocks, "monotonic_ns", self.read)
        monkeypatch.setattr(clocks, "select", self.select)
        monkeypatch.setattr(c_library, "Alarm", lambda: self)

    def read(self) -> int:
        self.instant += self.reading
        return self.instant

    def set(self, at: int) -> None:
        self.alarms.append(at)

    def select(
        self, sources: list[object], *_others: object
    ) -> tuple[list[object], list[object], list[object]]:
        if sources != [self]:
            return [], [], []
        self.instant = max(self.instant, self.alarms[-1])
        return [self], [], []


@pytest.fixture
def hardware(monkeypatch: pytest.MonkeyPatch) -> Hardware:
    return Hardware(monkeypatch)


def test_virtual_time_reaches_any_deadline_at_once_and_never_goes_back() -> None:
    clock = VirtualClock()
    clock.start(7)
    assert clock.now() == 7
    assert clock.wait(NEVER - 1, []) == []
    clock.wait(3, [])
    assert clock.now() == NEVER - 1


def test_virtual_time_stands_still_for_an_input(bell: Bell) -> None:
    clock = VirtualClock()
    bell.ring()
    assert clock.wait(SECOND, [bell]) == [bell]
    assert clock.now() == 0


def test_real_time_counts_from_the_start_of_the_run(hardware: Hardware) -> None:
    clock = MonotonicClock()
    hardware.instant += 3
    clock.start(100)
    hardware.instant += 20
    assert clock.now() == 120


def test_a_clock_notes_when_an_instant_that_had_passed_was_waited_for(hardware: Hardware) -> None:
    clock = MonotonicClock()
    clock.start(100)
    hardware.instant += SECOND
    clock.wait(200, [])
    assert clock.overdue_at == clock.now() == SECOND + 100


class Wait(NamedTuple):
    """A clock, what it waits for, and what the alarm is set to, if it is."""

    make: Callable[[], MonotonicClock]
    until: int
    alarm: int | None
    spin: int = 0
    reading: int = 0
    passed: int = 0


@pytest.mark.parametrize(
    "wait",
    [
        pytest.param(Wait(MonotonicClock, MILLISECOND, MILLISECOND, reading=7), id="deadline"),
        pytest.param(Wait(MonotonicClock, MILLISECOND, None, passed=SECOND), id="passed"),
        pytest.param(Wait(MonotonicClock, 1, 1), id="a nanosecond"),
        pytest.param(Wait(MonotonicClock, NEVER, clocks.LONGEST_WAIT), id="bound"),
        pytest.param(Wait(partial(ScaledClock, 0.001), NEVER, clocks.LONGEST_WAIT), id="scaled"),
        pytest.param(Wait(partial(ScaledClock, 3), 10, 4), id="not early by rounding"),
        pytest.param(
            Wait(MonotonicClock, MILLISECOND, 900_000, spin=100_000, reading=1_000),
            id="sleeps short of the deadline and spins up to it",
        ),
        pytest.param(
            Wait(MonotonicClock, 50_000, None, spin=100_000, reading=1_000), id="spins at once"
        ),
    ],
)
def test_a_wait_sets_the_alarm_to_its_deadline(hardware: Hardware, wait: Wait) -> None:
    clock = wait.make()
    clock.spin = wait.spin
    clock.start(0)
    hardware.instant += wait.passed
    hardware.reading = wait.reading
    assert clock.wait(wait.until, []) == []
    assert hardware.alarms == ([] if wait.alarm is None else [5 * SECOND + wait.alarm])
    assert wait.until == NEVER or clock.now() >= wait.until


def test_a_late_loop_still_takes_its_inputs(bell: Bell) -> None:
    clock = MonotonicClock()
    clock.start(SECOND)
    bell.ring()
    assert clock.wait(0, [bell]) == [bell]


def test_an_input_ends_a_wait(bell: Bell) -> None:
    clock = MonotonicClock()
    clock.start(0)
    bell.ring()
    assert clock.wait(100 * SECOND, [bell]) == [bell]
    assert clock.now() < 100 * SECOND


def test_scaled_time_is_faster_by_its_speed(hardware: Hardware) -> None:
    clock = ScaledClock(2.5)
    assert clock.now() == 0
    clock.start(SECOND)
    hardware.instant += 4 * MILLISECOND
    assert clock.now() == SECOND + 10 * MILLISECOND
    clock.wait(SECOND + 35 * MILLISECOND, [])
    assert hardware.alarms == [5 * SECOND + 14 * MILLISECOND]
    assert clock.now() == SECOND + 35 * MILLISECOND


@pytest.mark.parametrize("speed", [0, -1, float("inf"), float("nan")])
def test_a_speed_that_is_none_is_refused(speed: float) -> None:
    with pytest.raises(ValueError, match="expected a positive number"):
        ScaledClock(speed)


def test_an_input_ends_a_wait_without_a_spin(bell: Bell) -> None:
    clock = MonotonicClock()
    clock.spin = 10 * SECOND
    clock.start(0)
    bell.ring()
    assert clock.wait(5 * SECOND, [bell]) == [bell]
    assert clock.now() < 5 * SECOND


@pytest.mark.usefixtures("hardware")
def test_a_wait_that_ends_at_its_bound_does_not_spin() -> None:
    clock = MonotonicClock()
    clock.spin = 100_000
    clock.start(0)
    clock.wait(SECOND, [])
    assert clock.now() == clocks.LONGEST_WAIT


def test_an_alarm_that_has_rung_is_no_source(bell: Bell) -> None:
    clock = MonotonicClock()
    clock.start(0)
    assert clock.wait(MILLISECOND, [bell]) == []
    assert clock.now() >= MILLISECOND


def test_without_an_alarm_it_sleeps_up_to_its_deadline_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clocks, "IS_LINUX", False)
    clock = MonotonicClock()
    clock.start(0)
    assert clock.wait(MILLISECOND, []) == []
    assert clock.now() >= MILLISECOND


def test_without_an_alarm_an_input_ends_a_wait_too(
    bell: Bell, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clocks, "IS_LINUX", False)
    clock = MonotonicClock()
    clock.start(0)
    bell.ring()
    assert clock.wait(100 * SECOND, [bell]) == [bell]


def test_a_step_on_time_happens_at_its_logical_instant() -> None:
    world = WorldClock(tolerance=100)
    world.begin(1_000, 1_100)
    assert world() == 1_000


def test_a_late_step_happens_when_it_started() -> None:
    world = WorldClock(tolerance=100)
    world.begin(1_000, 1_101)
    assert world() == 1_101


def test_within_a_step_it_goes_on_by_what_transactions_take() -> None:
    world = WorldClock(tolerance=100)
    world.begin(1_000, 1_100)
    world.reach(1_600)
    world.reach(1_300)
    assert (world(), world.elapsed()) == (1_600, 600)


def test_the_next_step_begins_at_its_instant_or_where_the_world_is() -> None:
    world = WorldClock(tolerance=100)
    world.begin(1_000, 1_000)
    world.reach(2_500)
    world.begin(2_000, 2_000)
    assert (world(), world.elapsed()) == (2_500, 500)
    world.begin(3_000, 3_000)
    assert (world(), world.elapsed()) == (3_000, 0)


def test_outside_of_this_process_it_goes_on_by_itself() -> None:
    clock = ManualClock(at=7_000)
    world = OutsideClock(clock)
    world.begin(6_900, 7_000)
    assert world.elapsed() == 100
    clock.advance(50)
    assert world.elapsed() == 150


def test_a_transaction_outside_takes_no_less_than_its_bits() -> None:
    clock = ManualClock()
    world = OutsideClock(clock)
    world.begin(0, 0)
    world.reach(600)
    clock.advance(200)
    assert world.elapsed() == 600
    clock.advance(500)
    assert world.elapsed() == 700


def test_before_the_first_step_only_the_wire_takes_time() -> None:
    clock = ManualClock(at=9_000)
    world = OutsideClock(clock)
    world.reach(world() + 300)
    assert world() == 300


@given(st.lists(st.tuples(st.integers(0, 1000), st.integers(0, 1000))))
def test_it_never_goes_back(steps: list[tuple[int, int]]) -> None:
    world, before = WorldClock(tolerance=100), 0
    for at, late in steps:
        world.begin(at, at + late)
        assert world() >= before
        before = world()


def instants_of_the_world(stalls: dict[int, int]) -> list[int]:
    robot = Robot()
    run = Run(robot, StallingClock(stalls) if stalls else VirtualClock())
    seen: list[int] = []
    robot.thrust.work = lambda _value: seen.append(run.executive.world_now())
    run.until(6 * PERIOD)
    return seen


def test_a_run_that_is_never_late_shows_the_world_the_instants_of_virtual_time() -> None:
    within_tolerance = dict.fromkeys(range(7), MILLISECOND)
    assert instants_of_the_world(within_tolerance) == instants_of_the_world({})


def test_a_stall_shows_in_the_world_as_long_as_it_lasts_and_no_longer() -> None:
    assert instants_of_the_world({2: 25 * MILLISECOND}) == [
        0,
        PERIOD,
        45 * MILLISECOND,
        5 * PERIOD,
        6 * PERIOD,
    ]


def test_the_strictest_model_decides_what_is_late() -> None:
    policies = {"compass": ActivationPolicy(tolerance_us=20)}
    run = Run(Robot(compass=PERIOD), VirtualClock(), Configuration(policies=policies))
    assert run.executive.world_now.tolerance == 20_000


def test_a_loop_that_writes_without_end_in_one_instant_does_not_run_ahead_of_the_clock() -> None:
    world = WorldClock()
    for _ in range(1000):
        world.begin(SECOND, started=SECOND + 3)
        world.reach(world() + SECOND // 100)
    assert world() == SECOND + 3 + FURTHEST_AHEAD
    world.begin(2 * SECOND, started=2 * SECOND)
    assert world() == 2 * SECOND
