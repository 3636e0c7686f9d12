from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import (
    FURTHEST_AHEAD,
    OutsideClock,
    VirtualClock,
    WorldClock,
)
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.policy import ActivationPolicy
from sim_doubles.clock import ManualClock
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot
from tests.support.stalling_clock import StallingClock


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
