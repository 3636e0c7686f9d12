"""A hierarchy and its flat equal are the same model: they send the same values at the same times.

Also: a run is a function of its model. Nothing depends on addresses or on hash seeds.
"""

import os
import subprocess
import sys
from pathlib import Path
from typing import TypeAlias

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firmware_runtime.devs.classic import ClassicSimulator
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.trace import trace
from tests.support.devs_models import traced
from tests.support.random_models import SIDES, Node, blueprints, build, build_flat, routes

pytestmark = pytest.mark.slow

Inputs: TypeAlias = list[tuple[int, int, int]]
Trace: TypeAlias = list[tuple[int, str, str, int]]

INPUTS = st.lists(
    st.tuples(st.integers(0, 12), st.sampled_from(SIDES), st.integers(0, 9)), max_size=5
)


def run(kind: type[Engine], model: Component, inputs: Inputs) -> Trace:
    """What every cell sent, up to 30 ns, with inputs (instant, side, value) of the root."""
    simulator = kind(model)
    sent: Trace = []

    def listen(name: str, port: str) -> None:
        output = cells[name].out_ports[port]
        simulator.listen(output, lambda at, value: sent.append((at, name, port, value)))

    cells = {atomic.name: atomic for atomic in simulator.atomics}
    for name, cell in cells.items():
        for port in cell.out_ports:
            listen(name, port)
    for at, side, value in sorted(inputs):
        simulator.run(max(simulator.now, at - 1))
        simulator.inject(model.in_ports[f"in_{side}"], value)
        simulator.advance(at)
    simulator.run(30)
    return sent


@pytest.mark.parametrize("kind", [Simulator, ClassicSimulator])
@settings(max_examples=80, suppress_health_check=[HealthCheck.too_slow])
@given(blueprint=blueprints(), inputs=INPUTS)
def test_a_hierarchy_and_its_flat_equal_give_the_same_trace(
    kind: type[Engine], blueprint: Node, inputs: Inputs
) -> None:
    assert run(kind, build(blueprint), inputs) == run(kind, build_flat(blueprint), inputs)


@settings(max_examples=50, suppress_health_check=[HealthCheck.too_slow])
@given(blueprint=blueprints(), inputs=INPUTS)
def test_checked_mode_and_a_second_run_change_nothing(blueprint: Node, inputs: Inputs) -> None:
    first = run(Simulator, build(blueprint), inputs)
    model = build(blueprint)
    Simulator(model, checked=True).run(10)
    assert run(Simulator, model, inputs) == first


@settings(max_examples=50, suppress_health_check=[HealthCheck.too_slow])
@given(blueprint=blueprints())
def test_a_loop_that_advances_instant_by_instant_gives_the_same_trace(blueprint: Node) -> None:
    stepped = Simulator(build(blueprint))
    sent: list[tuple[int, str, object]] = []
    trace(stepped, lambda at, path, value: sent.append((at, path, value)))
    while stepped.next_at <= 30:
        stepped.advance(stepped.next_at)
    run_at_once = Simulator(build(blueprint))
    assert sent == traced(run_at_once, 30)
    assert counts(stepped) == counts(run_at_once)


def counts(simulator: Engine) -> tuple[int, int]:
    """Internal and external transitions so far."""
    return simulator.internal_transitions, simulator.external_transitions


def test_the_random_models_do_send_and_their_routes_cross_levels() -> None:
    example = Node("root", 0, ())
    inner = Node("inner", 0, (), [Node("a", 1, (2, 0, 3)), Node("b", 4, (1, 5))])
    example.children = [Node("c", 7, (3, 1)), inner]
    inner.wires = [
        (("inner", "in_0"), ("a", "in_1")),
        (("a", "out_0"), ("b", "in_0")),
        (("a", "out_1"), ("inner", "out_1")),
    ]
    example.wires = [
        (("c", "out_0"), ("inner", "in_0")),
        (("inner", "out_1"), ("c", "in_1")),
        (("root", "in_1"), ("inner", "in_0")),
    ]
    assert routes(example) == [
        (("c", "out_0"), ("a", "in_1")),
        (("a", "out_0"), ("b", "in_0")),
        (("a", "out_1"), ("c", "in_1")),
        (("root", "in_1"), ("a", "in_1")),
    ]
    trace = run(Simulator, build(example), [(4, 1, 3)])
    assert {name for _, name, _, _ in trace} == {"a", "b", "c"}
    assert len(trace) > 10


SCRIPT = """
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.trace import trace
from tests.support.devs_models import traced
from tests.support.devs_models import Clock, Echo, Log, top, traced

clocks = [Clock(f"clock_{number}", 1 + number % 3) for number in range(9)]
echoes = [Echo(f"echo_{number}", number % 2) for number in range(9)]
model = top(*clocks, *echoes)
for clock in clocks:
    for echo in echoes:
        model.couple(clock.ticks, echo.inlet)
print(traced(Simulator(model), 6))
"""


def test_the_order_of_messages_does_not_depend_on_the_hash_seed() -> None:
    outputs = {
        subprocess.run(
            [sys.executable, "-c", SCRIPT],
            cwd=Path(__file__).parents[2],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": "."},
            capture_output=True,
            check=True,
        ).stdout
        for seed in ("0", "1", "2")
    }
    assert len(outputs) == 1
    assert b"echo_8.out" in outputs.pop()
