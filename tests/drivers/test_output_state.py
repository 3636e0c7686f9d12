"""Whether outputs are enabled is said at first, and when it changes."""

from firmware_drivers.output_state import OutputState

from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND


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
