"""Sources and delays in systems: as exact as the quantum asks for, in outputs and events too."""

import math

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.models.qss import (
    Constant,
    Samples,
    Segment,
    Simulation,
    Sine,
    System,
    When,
    solve,
)
from firmware_runtime.models.qss.sources import Schedule

METHODS = ["QSS1", "QSS2", "QSS3", "LIQSS2"]


@pytest.mark.parametrize("method", METHODS)
def test_a_state_may_be_its_own_derivative(method: str) -> None:
    system = System(states={"x": 1.0}, equations={"x": "x"}, method=method)
    _, values = solve(system, times=[1.0])
    assert values["x"] == pytest.approx([math.e], abs=2e-3)


@pytest.mark.parametrize("method", METHODS)
def test_a_rate_may_grow_with_time(method: str) -> None:
    system = System(states={"x": 1.0}, equations={"x": "-exp(t) * x"}, method=method)
    _, values = solve(system, times=[1.0])
    assert values["x"] == pytest.approx([math.exp(1.0 - math.e)], abs=2e-3)


@pytest.mark.parametrize(("method", "quantum"), [("QSS2", 1e-6), ("QSS3", 1e-8), ("LIQSS2", 1e-6)])
def test_a_sine_of_an_input_is_within_the_quantum_however_small(
    method: str, quantum: float
) -> None:
    system = System(
        states={"x": 0.0},
        equations={"x": "u - x"},
        inputs={"u": Sine("u", 0.5, amplitude=3.0)},
        method=method,
        quantum=quantum,
    )
    times, values = solve(system, until=1.0, samples=41)
    w = math.pi
    exact = [
        3.0 * (math.sin(w * t) - w * math.cos(w * t) + w * math.exp(-t)) / (1.0 + w * w)
        for t in times
    ]
    assert values["x"] == pytest.approx(exact, abs=quantum)


def test_what_does_not_read_an_input_goes_on_before_that_has_come() -> None:
    system = System(
        states={"x": 0.0, "y": 0.0},
        discrete={"n": 0},
        equations={"x": "u", "y": "1"},
        inputs={"u": Schedule("u", [(1.0, Segment(2.0))])},
        events=[When("y > 0.25", n="n + 1"), When("u > 1", n="n + 10")],
        outputs=["x", "y", "n"],
    )
    _, values = solve(system, times=[0.5, 2.0])
    assert values == {"x": [0.0, 2.0], "y": [0.5, 2.0], "n": [1.0, 1.0]}


@pytest.mark.slow
def test_a_sine_is_read_in_outputs_events_and_delays_as_it_is() -> None:
    system = System(
        states={"x": 0.0},
        discrete={"n": 0},
        equations={"x": "delay(u, 0.25)"},
        inputs={"u": Sine("u", 1.0)},
        events=[When("u crosses 0.5 rising", n="n + 1")],
        outputs=["x", "n", "u", "delay(u, 0.25)", "delay(u, 0.25, 7)"],
        quantum=1e-6,
    )
    _, values = solve(system, times=[0.2, 1.0, 2.2])
    assert values["u"] == pytest.approx([math.sin(math.tau * t) for t in (0.2, 1.0, 2.2)])
    assert values["delay(u, 0.25)"] == pytest.approx(
        [0.0, math.sin(math.tau * 0.75), math.sin(math.tau * 1.95)]
    )
    assert values["delay(u, 0.25, 7)"][0] == 7.0
    assert values["n"] == [1.0, 1.0, 3.0]
    moved = [(1.0 - math.cos(math.tau * t)) / math.tau for t in (0.75, 1.95)]
    assert values["x"] == pytest.approx([0.0, *moved], abs=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_outputs_and_events_read_what_was_half_a_second_ago(method: str) -> None:
    system = System(
        states={"x": 0.0},
        discrete={"n": 0},
        equations={"x": "1"},
        inputs={"u": Constant("u", 3.0)},
        events=[When("delay(x, 0.5) >= 1", n="delay(x, 1)")],
        outputs=["delay(x, 0.5)", "n", "delay(u, 0.5)", "delay(u, 0.5, 7)"],
        method=method,
    )
    _, values = solve(system, times=[0.25, 1.25, 2.0])
    assert values["delay(x, 0.5)"] == pytest.approx([0.0, 0.75, 1.5])
    assert values["n"] == pytest.approx([0.0, 0.0, 0.5], abs=2e-3)
    assert values["delay(u, 0.5)"] == [0.0, 3.0, 3.0]
    assert values["delay(u, 0.5, 7)"] == [7.0, 3.0, 3.0]


def test_an_event_at_the_instant_at_which_its_input_turns_is_of_that_instant() -> None:
    bent = Samples("u", [(0.0, 0.75), (0.25, 1.0), (0.75, 3.0)])
    system = System(
        states={"x": 0.0},
        discrete={"at": 0},
        equations={"x": "0"},
        inputs={"u": bent},
        events=[When("u crosses 1 rising", at="t")],
        outputs=["at"],
    )
    assert solve(system, times=[0.5])[1]["at"] == [0.25]


def test_a_discrete_value_is_set_from_outside_at_the_port_of_its_name() -> None:
    simulation = Simulation(System({"x": 0.0}, {"x": "rate"}, discrete={"rate": 0}))
    simulation.advance(SECOND)
    simulation.simulator.inject(simulation.model.in_ports["rate"], Segment(2.0))
    simulation.simulator.advance(SECOND)
    simulation.advance(2 * SECOND)
    assert simulation.values["x"] == pytest.approx(2.0)


@pytest.mark.parametrize(
    "arguments", ["x", "", "2*x, 1", "x, -1", "x, 1 + t", "x, 1e300 * 1e300", "x, 1, 1 / t"]
)
def test_a_delay_of_what_cannot_be_delayed_is_refused_wherever_it_stands(
    arguments: str,
) -> None:
    text = f"delay({arguments})"
    outside = System(states={"x": 0.0}, equations={"x": "1"}, outputs=[text])
    inside = System(states={"x": 0.0}, equations={"x": text})
    for system in (outside, inside):
        with pytest.raises(ConfigError, match=r"expected delay\(NAME, SECONDS\)"):
            solve(system, until=1.0)
