"""Where a source or an engine stands is kept as plain values; it goes on from them as it did."""

import json
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import SECOND, seconds
from firmware_runtime.models.qss import Simulation, When
from firmware_runtime.models.qss.engine import Engine
from firmware_runtime.models.qss.model import SystemModel
from firmware_runtime.models.qss.sources import (
    Constant,
    Pulse,
    Ramp,
    Samples,
    Schedule,
    Square,
    Step,
)
from firmware_runtime.models.qss.system import System
from firmware_runtime.recording.blackbox.state.keyframes import StateTable

SAMPLES = [(0.3, 1.0), (0.9, 3.0), (1.5, -1.0)]
SOURCES: list[Callable[[], Schedule]] = [
    partial(Constant, "s", 2.0),
    partial(Step, "s", 0.7),
    partial(Ramp, "s", 2.0, at_s=0.2, until_s=1.1),
    partial(Pulse, "s", 0.25, 0.5),
    partial(Square, "s", 0.3, duty=0.4),
    partial(Samples, "s", SAMPLES),
    partial(Samples, "s", [(0.0, 4.0), *SAMPLES], holds=True),
]


def gone_on_from_a_keyframe(model: Component, begins_s: float, ends_s: float) -> int:
    """Assert that a model sends the same after a keyframe as it did; return how much that is."""
    simulator, sent = Simulator(model), list[tuple[int, object]]()
    for port in model.out_ports.values():
        simulator.listen(port, lambda at, segment: sent.append((at, segment)))
    table = StateTable({"model": model, "simulator": simulator}, [sent])
    simulator.run(seconds(begins_s))
    kept, first = table.capture(), len(sent)
    simulator.run(seconds(ends_s))
    whole = list(sent)
    table.restore(kept)
    del sent[first:]
    simulator.run(seconds(ends_s))
    assert sent == whole
    return len(whole) - first


@pytest.mark.parametrize("make", SOURCES)
@pytest.mark.parametrize("begins_s", [0.1, 0.8, 1.2])
def test_it_goes_on_from_a_keyframe(make: Callable[[], Schedule], begins_s: float) -> None:
    gone_on_from_a_keyframe(make(), begins_s, 2.0)


def test_a_system_goes_on_from_a_keyframe_denominators_and_angles_included() -> None:
    equations = {"x": "v", "v": "-x - v / (3 + x)", "a": "atan2(v, x)"}
    system = System(states={"x": 1.0, "v": 0.0, "a": 0.0}, equations=equations)
    assert gone_on_from_a_keyframe(SystemModel(system), 2.0, 5.0) > 0


def test_the_same_segments_begin_at_the_same_instants() -> None:
    sent: list[tuple[int, float, float]] = []
    source = Samples("s", SAMPLES)
    simulator = Simulator(source)
    simulator.listen(source.out, lambda at, each: sent.append((at, each.value, each.slope)))
    simulator.run(seconds(9.0))
    assert sent == [
        (0, 1.0, 0.0),
        (300_000_000, 1.0, pytest.approx(2.0 / 0.6)),
        (900_000_000, 3.0, pytest.approx(-4.0 / 0.6)),
        (1_500_000_000, -1.0, 0.0),
    ]


SYSTEM = System(
    states={"x": 1.0, "v": 0.0, "a": 0.0},
    discrete={"bounces": 0},
    equations={
        "x": "v",
        "v": "-9.81 - 0.1 * v * abs(v) + sin(3 * t) / (3 + x)",
        "a": "atan2(v, x) / (3 + x) if x > 0.1 else exp(-x)",
    },
    events=[When("x crosses 0 falling", v="-0.8 * v", bounces="bounces + 1")],
)


def gone_on(engine: Engine, until: int) -> tuple[int, Any]:
    """Steps of an engine without inputs, by hand: how many, and its state at the end."""
    at, number = engine.state()["own"][0], 0
    while at + engine.time_advance() <= until:
        at += engine.time_advance()
        engine.output()
        engine.internal()
        number += 1
    return number, engine.state()


def test_it_goes_on_from_plain_values_as_it_did() -> None:
    for method in ("QSS1", "QSS2", "QSS3", "LIQSS2"):
        system = System(**{**vars(SYSTEM), "method": method, "quantum": 1e-2})
        simulation = Simulation(system)
        simulation.advance(seconds(0.7))
        kept = json.loads(json.dumps(simulation.model.engine.state()))
        steps, end = gone_on(simulation.model.engine, SECOND)
        assert steps > 5
        fresh = Simulation(system).model.engine
        fresh.restore(kept)
        assert gone_on(fresh, SECOND) == (steps, end)
