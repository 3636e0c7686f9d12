from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.models.delay import Delay


def delayed(arrivals: list[tuple[int, int]], duration_ms: int) -> list[tuple[int, int]]:
    """What leaves a delay, as (ms, value), for values arriving at (ms, value)."""
    top = Coupled("top")
    delay = top.add(Delay("delay", int, duration_ms * MILLISECOND))
    entrance = top.in_port("in", int)
    top.couple(entrance, delay.entrance)
    simulator = Simulator(top, checked=True)
    left: list[tuple[int, int]] = []
    simulator.listen(delay.delayed, lambda at, value: left.append((at // MILLISECOND, value)))
    for at_ms, value in arrivals:
        simulator.run(max(simulator.now, at_ms * MILLISECOND - 1))
        simulator.inject(entrance, value)
        simulator.advance(at_ms * MILLISECOND)
    simulator.run(10_000 * MILLISECOND)
    return left


def test_values_leave_after_the_delay_in_order_though_they_overlap() -> None:
    arrivals = [(0, 1), (10, 2), (20, 3), (100, 4)]
    assert delayed(arrivals, 25) == [(25, 1), (35, 2), (45, 3), (125, 4)]


def test_a_value_that_arrives_as_another_leaves_is_not_lost() -> None:
    assert delayed([(0, 1), (10, 2)], 10) == [(10, 1), (20, 2)]


def test_two_values_of_one_instant_leave_together() -> None:
    assert delayed([(5, 1), (5, 2)], 7) == [(12, 1), (12, 2)]


def test_a_delay_of_zero_passes_on_at_the_same_instant() -> None:
    assert delayed([(3, 1)], 0) == [(3, 1)]
