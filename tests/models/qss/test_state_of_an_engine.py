"""What an engine keeps at a keyframe are plain values, and it goes on from them as it did."""

import json
from typing import Any

from firmware_runtime.devs.time import SECOND, seconds
from firmware_runtime.models.qss import Simulation, System, When
from firmware_runtime.models.qss.engine import Engine

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
