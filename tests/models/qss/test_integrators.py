import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from firmware_runtime.devs.classic import ClassicSimulator
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.models.qss import (
    LIQSS2,
    QSS1,
    QSS2,
    QSS3,
    Function,
    Integrator,
    Ramp,
    Segment,
    Simulation,
    Step,
    System,
    When,
    error_bound,
    solve,
)

METHODS = ("QSS1", "QSS2", "QSS3", "LIQSS2")
OSCILLATOR = {"x": "v", "v": "-x - 0.2 * v"}


def oscillation(method: str, quantum: float, *, checked: bool = False) -> Simulation:
    system = System({"x": 1.0, "v": 0.0}, OSCILLATOR, method, quantum)
    return Simulation(system, checked=checked)


def worst_error(simulation: Simulation) -> float:
    """Of x, over 20 s."""
    frequency, worst = math.sqrt(0.99), 0.0
    for tick in range(1, 201):
        t = 0.1 * tick
        simulation.advance(tick * 100 * MILLISECOND)
        turn = math.cos(frequency * t) + 0.1 / frequency * math.sin(frequency * t)
        worst = max(worst, abs(simulation.values["x"] - math.exp(-0.1 * t) * turn))
    return worst


@pytest.mark.parametrize("method", METHODS)
def test_the_error_of_a_linear_system_is_within_its_bound(method: str) -> None:
    quantum = 1e-3
    bound, _ = error_bound([[0.0, 1.0], [-1.0, -0.2]], [quantum, quantum])
    assert 0.0 < worst_error(oscillation(method, quantum)) <= bound


@pytest.mark.parametrize(
    ("matrix", "quanta", "sentence"),
    [
        ([[-1.0, 1.0], [0.0, -1.0]], [0.1, 0.1], "without a full set of eigenvectors"),
        ([[0.0, 1.0], [-1.0, 0.0]], [0.1, 0.1], "expected negative real parts"),
        ([[-1.0, 0.0]], [0.1], r"a matrix of shape \(1, 2\); expected rows as long"),
        ([], [], r"a matrix of shape \(0,\); expected rows as long"),
        ([[]], [], r"a matrix of shape \(1, 0\)"),
        ([[-1.0, 0.0], [0.0]], [0.1, 0.1], "matrix .*; expected numbers, in rows of equal length"),
        ([["x"]], [0.1], "matrix .*; expected numbers"),
        ([[math.nan]], [0.1], "matrix .*nan.*; expected finite numbers"),
        ([[-1.0]], [math.inf], "quanta .*inf.*; expected finite numbers"),
        ([[-1.0]], [0.1, 0.1], r"quanta \[0.1 0.1\]; expected 1 of them, 0 or more"),
        ([[-1.0]], [-0.1], r"quanta \[-0.1\]; expected 1 of them, 0 or more"),
    ],
)
def test_a_system_without_a_bound_is_refused_by_its_own_fault(
    matrix: list[list[float]], quanta: list[float], sentence: str
) -> None:
    with pytest.raises(ModelError, match=f"^error_bound: .*{sentence}"):
        error_bound(matrix, quanta)


@pytest.mark.parametrize(
    ("method", "order"), [("QSS1", 1), ("QSS2", 2), ("QSS3", 3), ("LIQSS2", 2)]
)
def test_an_eighth_of_the_quantum_takes_as_many_steps_more_as_the_order_says(
    method: str, order: int
) -> None:
    steps, errors = [], []
    for quantum in (8e-3, 1e-3):
        simulation = oscillation(method, quantum)
        errors.append(worst_error(simulation))
        steps.append(simulation.model.steps)
    assert steps[1] / steps[0] == pytest.approx(8.0 ** (1.0 / order), rel=0.2)
    assert errors[0] / errors[1] > 4.0  # the error is of the order of the quantum


@pytest.mark.slow
@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.integers(1, 4), st.sampled_from(METHODS[1:]))
def test_random_stable_linear_systems_stay_within_their_bound(
    seed: int, size: int, method: str
) -> None:
    generator = np.random.default_rng(seed)
    matrix = generator.normal(size=(size, size))
    matrix -= (max(np.linalg.eigvals(matrix).real) + 0.3) * np.eye(size)
    start, quanta = generator.normal(size=size), generator.uniform(1e-4, 1e-2, size)
    names = [f"x{number}" for number in range(size)]
    terms = [
        " + ".join(f"({factor!r}) * {name}" for factor, name in zip(row, names, strict=True))
        for row in matrix.tolist()
    ]
    system = System(
        dict(zip(names, start.tolist(), strict=True)),
        dict(zip(names, terms, strict=True)),
        method,
        dict(zip(names, quanta.tolist(), strict=True)),
    )
    times, values = solve(system, 4.0, samples=41)
    bound = error_bound(matrix.tolist(), quanta.tolist())
    for index, t in enumerate(times):
        exact = expm(matrix * t) @ start
        for name, value, most in zip(names, exact, bound, strict=True):
            assert abs(values[name][index] - value) <= most * (1.0 + 1e-9) + 1e-9


STIFF = {"x": "0.01 * y", "y": "-100 * x - 100 * y + 2020"}


@pytest.mark.slow
def test_a_stiff_system_takes_few_steps_under_liqss2_and_thousands_under_qss2() -> None:
    steps = {}
    for method in ("QSS2", "LIQSS2"):
        simulation = Simulation(System({"x": 0.0, "y": 20.0}, STIFF, method, 0.1))
        simulation.advance(100 * SECOND)
        steps[method] = simulation.model.steps
        exact = expm(np.array([[0.0, 0.01], [-100.0, -100.0]]) * 100.0)
        resting = np.array([20.2, 0.0])
        end = exact @ (np.array([0.0, 20.0]) - resting) + resting
        assert simulation.values["x"] == pytest.approx(end[0], abs=0.2)
    assert steps["LIQSS2"] < 100
    assert steps["QSS2"] > 5000


@pytest.mark.parametrize("stiffness", [1e3, 1e5, 1e7])
def test_the_steps_of_liqss2_do_not_grow_with_the_stiffness(stiffness: float) -> None:
    equations = {"fast": f"{stiffness} * (slow - fast)", "slow": "-slow"}
    simulation = Simulation(System({"fast": 0.0, "slow": 1.0}, equations, "LIQSS2", 1e-3))
    simulation.advance(3 * SECOND)
    assert simulation.model.steps < 400
    assert simulation.values["fast"] == pytest.approx(math.exp(-3.0), abs=3e-3)


ROBERTSON = {
    "a": "-0.04 * a + 1e4 * b * c",
    "b": "0.04 * a - 1e4 * b * c - 3e7 * b * b",
    "c": "3e7 * b * b",
}


def test_the_steps_of_a_stiff_reaction_grow_as_the_quantum_shrinks() -> None:
    """Robertson's, whose equilibrium drifts: b follows a and c within a millisecond."""
    steps = []
    for share in (1.0, 0.3, 0.1):
        quantum = {"a": 1e-3 * share, "b": 1e-8 * share, "c": 1e-3 * share}
        system = System({"a": 1.0, "b": 0.0, "c": 0.0}, ROBERTSON, "LIQSS2", quantum)
        simulation = Simulation(system)
        simulation.advance(400 * SECOND)
        steps.append(simulation.model.steps)
        assert simulation.values["a"] == pytest.approx(0.450519, abs=1e-3 * share)
    assert steps == sorted(steps)
    assert steps[0] < 600


STUCK = System(
    states={"x": 0.0, "v": 0.0},
    discrete={"slides": 0},
    definitions={"force": "2 * (0.1 * t - x)"},
    equations={"x": "v", "v": "force - 0.6 if slides else 0"},
    events=[
        When("force crosses 1 rising", only_if="not slides", slides=1),
        When("v crosses 0 falling", only_if="slides", v=0, slides=0),
    ],
    method="LIQSS2",
)


@pytest.mark.parametrize("quantum", [1e-3, 3e-4])
def test_liqss2_takes_no_change_at_an_event_for_an_answer(quantum: float) -> None:
    """A mass that stands still after it slipped, by an equation that does not read its speed."""
    simulation = Simulation(replace(STUCK, quantum=quantum))
    simulation.advance(8 * SECOND)
    assert simulation.values["v"] == 0.0
    before = simulation.model.steps
    simulation.advance(11 * SECOND)
    assert simulation.model.steps <= before + 2


def test_a_step_of_liqss2_ends_where_its_line_that_began_half_the_quantum_off_touches() -> None:
    simulation = Simulation(System({"x": 0.0}, {"x": "t"}, "LIQSS2", quantum=1e-2))
    simulation.advance(10 * SECOND)
    assert simulation.model.steps == pytest.approx(10.0 / math.sqrt(1e-2), abs=2)


def test_a_line_of_liqss2_that_begins_at_its_state_holds_to_the_edge_of_the_quantum() -> None:
    simulation, steps = Simulation(System({"x": 0.0}, {"x": "1 - t"}, "LIQSS2", quantum=1.0)), []
    for at_s in (2.7, 2.74):  # x is -1 at 1 + sqrt(3) s, after it was 0.5 at 1 s
        simulation.advance(round(at_s * SECOND))
        steps.append(simulation.model.steps)
    assert steps == [0, 1]


def test_an_event_that_sets_a_state_and_its_rate_costs_liqss2_one_step() -> None:
    event = When("t >= 1", x="x + 1", rate=-100)
    system = System({"x": 0.0}, {"x": "rate"}, "LIQSS2", discrete={"rate": 1.0}, events=[event])
    simulation, steps = Simulation(system), []
    for at in (SECOND - 1, SECOND + 1):
        simulation.advance(at)
        steps.append(simulation.model.steps)
    assert steps[1] == steps[0] + 1


@pytest.mark.slow
@pytest.mark.parametrize("method", [QSS1, QSS2, QSS3, LIQSS2])
def test_the_quantized_state_is_never_further_off_than_the_quantum(
    method: type[Integrator],
) -> None:
    quantum, far = 1e-2, []
    top = Coupled("top")
    x = top.add(method("x", 1.0, quantum))
    f = top.add(Function("f", "sin(3 * t) - 2 * x", ["x"], order=method.order))
    top.couple(x.out, f.inputs["x"])
    top.couple(f.out, x.derivative)
    simulator = Simulator(top)
    sent: list[tuple[int, Segment]] = []
    simulator.listen(x.out, lambda at, segment: sent.append((at, segment)))
    for at in range(0, SECOND, SECOND // 500):
        simulator.run(at)
        since, segment = sent[-1]
        far.append(abs(x.value_at(at) - segment.at((at - since) * 1e-9)))
    assert 0.4 * quantum < max(far) <= quantum * (1.0 + 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_checked_mode_finds_nothing_and_changes_nothing(method: str) -> None:
    plain, checked = oscillation(method, 1e-2), oscillation(method, 1e-2, checked=True)
    plain.advance(3 * SECOND)
    checked.advance(3 * SECOND)
    assert plain.values == checked.values


def test_a_classic_simulator_gives_the_same_within_the_bound() -> None:
    simulation = oscillation("QSS2", 1e-3)
    simulation.simulator = ClassicSimulator(simulation.model)  # type: ignore[assignment]
    assert worst_error(simulation) < 1e-2


@pytest.mark.parametrize("method", [QSS1, QSS2, QSS3])
def test_a_step_of_less_than_a_nanosecond_is_refused(method: type[Integrator]) -> None:
    system = System({"x": 1.0}, {"x": "-1e9 * x"}, method.__name__, 1e-12)
    with pytest.raises(ModelError, match=r"system\.x: a step of .* expected 1 ns or more"):
        Simulation(system).advance(SECOND)


@pytest.mark.parametrize("method", [QSS1, QSS2, QSS3, LIQSS2])
def test_a_method_says_how_many_coefficients_its_derivative_has(method: type[Integrator]) -> None:
    assert method("x", 0.0, 1e-3).states["x"].order == method.order


def test_a_derivative_of_too_high_a_degree_is_refused() -> None:
    top = Coupled("top")
    x = top.add(QSS1("x", 0.0, 1e-3))
    ramp = top.add(Ramp("ramp", 1.0))
    top.couple(ramp.out, x.derivative)
    with pytest.raises(ModelError, match="order=1"):
        Simulator(top).run(SECOND)


@pytest.mark.parametrize("method", [QSS1, QSS2, QSS3, LIQSS2])
def test_a_reset_sets_the_state_and_sends_it_at_that_instant(method: type[Integrator]) -> None:
    top = Coupled("top")
    x = top.add(method("x", 0.0, 1e-3))
    slope = top.add(Step("slope", after=2.0))
    top.couple(slope.out, x.derivative)
    reset = top.in_port("reset", Segment)
    top.couple(reset, x.reset)
    simulator = Simulator(top)
    sent: list[tuple[int, float]] = []
    simulator.listen(x.out, lambda at, segment: sent.append((at, segment.value)))
    simulator.run(SECOND)
    simulator.inject(reset, Segment(-5.0))
    simulator.advance(SECOND)
    assert sent[-1] == (SECOND, -5.0)
    simulator.run(2 * SECOND)
    assert x.value_at(2 * SECOND) == pytest.approx(-3.0)


def test_a_relative_quantum_makes_the_steps_of_a_decay_equally_many_for_each_decade() -> None:
    top = Coupled("top")
    x = top.add(QSS2("x", 1.0, 1e-12, relative_quantum=1e-3))
    f = top.add(Function("f", "-x", ["x"]))
    top.couple(x.out, f.inputs["x"])
    top.couple(f.out, x.derivative)
    simulator, counts = Simulator(top), []
    for decade in range(5):
        simulator.run(round(decade * math.log(10.0) * SECOND))
        counts.append(x.steps)
    grown = [later - sooner for sooner, later in pairwise(counts)]
    assert max(grown) - min(grown) <= 3 < min(grown)


def test_a_state_at_rest_has_no_more_events() -> None:
    simulation = Simulation(System({"x": 1.0}, {"x": "0"}))
    simulation.advance(SECOND)
    assert simulation.simulator.next_at == NEVER


@pytest.mark.parametrize(
    "arguments", [(math.inf, 1e-3), (0.0, 0.0), (0.0, -1.0), (0.0, math.nan), (0.0, math.inf)]
)
def test_a_quantum_or_an_initial_value_that_is_none_is_refused(
    arguments: tuple[float, float],
) -> None:
    with pytest.raises(ModelError, match="expected"):
        QSS2("x", *arguments)


def test_a_state_that_grows_beyond_all_numbers_is_an_error_and_no_livelock() -> None:
    with pytest.raises(ModelError):
        Simulation(System({"x": 1.0}, {"x": "x * x"}, "QSS2", 1e-2)).advance(3 * SECOND)


@pytest.mark.parametrize("method", METHODS)
def test_a_derivative_that_is_no_number_is_refused(method: str) -> None:
    equations = {"x": "y * y - y * y", "y": "0"}
    system = System({"x": 1.0, "y": 1e200}, equations, method, {"x": 1e-3, "y": 1e190})
    with pytest.raises(ModelError, match=r"system\.x: its derivative is nan; expected a finite"):
        Simulation(system).advance(SECOND)
