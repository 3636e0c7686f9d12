from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.models.delay import Delay
from tests.support.atomic_bench import AtomicBench


def delayed(arrivals: list[tuple[int, int]], duration_ms: int) -> list[tuple[float, int]]:
    """What leaves a delay, as (ms, value), for values arriving at (ms, value)."""
    bench = AtomicBench(Delay("delay", int, duration_ms * MILLISECOND))
    for at_ms, value in arrivals:
        bench.meet(at_ms, **{"in": value})
    bench.run(10_000)
    return bench.said["out"]


def test_values_leave_after_the_delay_in_order_though_they_overlap() -> None:
    arrivals = [(0, 1), (10, 2), (20, 3), (100, 4)]
    assert delayed(arrivals, 25) == [(25, 1), (35, 2), (45, 3), (125, 4)]


def test_a_value_that_arrives_as_another_leaves_is_not_lost() -> None:
    assert delayed([(0, 1), (10, 2)], 10) == [(10, 1), (20, 2)]


def test_two_values_of_one_instant_leave_together() -> None:
    assert delayed([(5, 1), (5, 2)], 7) == [(12, 1), (12, 2)]


def test_a_delay_of_zero_passes_on_at_the_same_instant() -> None:
    assert delayed([(3, 1)], 0) == [(3, 1)]
