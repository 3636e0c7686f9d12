"""Where a source stands is part of its state: set back in the middle, it goes on as it did."""

from collections.abc import Callable
from functools import partial

import pytest

from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import seconds
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


@pytest.mark.parametrize("make", SOURCES)
@pytest.mark.parametrize("begins_s", [0.1, 0.8, 1.2])
def test_it_goes_on_from_a_keyframe(make: Callable[[], Schedule], begins_s: float) -> None:
    source, sent = make(), list[tuple[int, object]]()
    simulator = Simulator(source)
    simulator.listen(source.out, lambda at, segment: sent.append((at, segment)))
    table = StateTable({"model": source, "simulator": simulator}, [sent])
    simulator.run(seconds(begins_s))
    kept, first = table.capture(), len(sent)
    simulator.run(seconds(2.0))
    whole = list(sent)
    table.restore(kept)
    del sent[first:]
    simulator.run(seconds(2.0))
    assert sent == whole


def test_a_system_goes_on_from_a_keyframe_denominators_and_angles_included() -> None:
    equations = {"x": "v", "v": "-x - v / (3 + x)", "a": "atan2(v, x)"}
    system = System(states={"x": 1.0, "v": 0.0, "a": 0.0}, equations=equations)
    model, sent = SystemModel(system), list[tuple[int, object]]()
    simulator = Simulator(model)
    for port in model.out_ports.values():
        simulator.listen(port, lambda at, segment: sent.append((at, segment)))
    table = StateTable({"model": model, "simulator": simulator}, [sent])
    simulator.run(seconds(2.0))
    kept, first = table.capture(), len(sent)
    simulator.run(seconds(5.0))
    whole = list(sent)
    table.restore(kept)
    del sent[first:]
    simulator.run(seconds(5.0))
    assert sent == whole
    assert len(whole) > first


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
