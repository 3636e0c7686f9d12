"""Every crossing of a function is found, however short it is and however long one solves."""

import math
import random
from functools import cache
from typing import Any

import pytest

from firmware_runtime.models.qss import Sine, System, When, solve
from firmware_runtime.models.qss.expression import parse
from firmware_runtime.models.qss.program import Layout, compile_condition
from firmware_runtime.models.qss.watch import Watch

METHODS = ("QSS1", "QSS2", "QSS3", "LIQSS2")


def counted(event: str, until_s: float, **others: Any) -> float:  # noqa: ANN401 -- as a System has it
    """How often an event has happened by an instant."""
    given = {"states": {"x": 0.0}, "equations": {"x": "0"}, **others}
    events = [When(event, n="n + 1")]
    system = System(discrete={"n": 0}, events=events, outputs=["n"], **given)
    return solve(system, times=[until_s])[1]["n"][0]


@cache
def crossings_on_a_grid(event: str) -> int:
    """How often an event of t, which is also x, begins within 20 s, by steps of 50 us."""
    names = {name: getattr(math, name) for name in ("sin", "cos", "exp", "tanh", "atan", "sqrt")}
    code = compile(event, event, "eval")
    number, was = 0, True
    for tick in range(400_001):
        t = tick * 5e-5
        now = eval(code, names | {"t": t, "x": t})  # noqa: S307 -- the texts below
        number += now and not was
        was = now
    return number


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("quantum", [1e-2, 1e-9])
def test_a_sine_is_above_a_level_once_a_period(method: str, quantum: float) -> None:
    sine = {"u": Sine("u", 1.0)}
    for event in ("u > 0.9", "u crosses 0.9 rising", "u crosses 0.9 falling", "u < -0.999999"):
        options = {"inputs": sine, "method": method, "quantum": quantum}
        assert counted(event, 10.0, **options) == 10.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("duty", "periods"), [(1e-4, 2_000), (1e-3, 500), (0.01, 500), (0.05, 500), (0.15, 500)]
)
def test_pulses_of_a_small_share_of_their_period_are_all_found(duty: float, periods: int) -> None:
    level = math.cos(math.pi * duty)
    system = System(
        states={"x": 0.0},
        discrete={"n": 0},
        equations={"x": f"1 if cos(tau * t) > {level!r} else 0"},
        events=[When(f"cos(tau * t) < {level!r}", n="n + 1")],
        outputs=["n", "x"],
        quantum=1e-6,
    )
    _, values = solve(system, times=[periods + 0.25])
    assert values["n"] == [periods + 1.0]
    assert values["x"][0] == pytest.approx((periods + 0.5) * duty, abs=2e-9 * periods)


@pytest.mark.parametrize("scale", [0.01, 1.0, 1000.0])
@pytest.mark.parametrize(
    "text",
    ["cos(x) + 0.6", "sin(x) * cos(0.7 * x) - 0.1", "x**4 - 20 * x - 2", "exp(-x) - 0.3"],
)
def test_a_value_stays_on_its_side_for_as_long_as_is_said(text: str, scale: float) -> None:
    generator, layout = random.Random(text), Layout({"x": 2}, {})  # noqa: S311
    (condition,) = compile_condition(parse(f"{scale!r} * ({text})"), layout, at_zero=True)
    watch = Watch([condition])
    for _ in range(100):
        x, rate = generator.uniform(-3.0, 3.0), generator.uniform(-2.0, 2.0)
        watch.spans = [generator.uniform(0.1, 8.0)]
        clear = min(watch.settle(0.0, [x, rate]), 100.0)
        side = 1.0 if watch.sides[0] else -1.0
        for share in range(1, 20):
            value, *_ = condition.code(0.0, [], [x + rate * clear * share / 20, rate])
            assert side * value > 0.0


@pytest.mark.parametrize("sign", ["", "-"])
def test_a_power_beyond_a_cubic_holds_no_longer_than_to_its_root(sign: str) -> None:
    tree = parse(f"{sign}(1 - x * x * x * x)")
    (condition,) = compile_condition(tree, Layout({"x": 2}, {}), at_zero=True)
    for span in (0.5, 1.1, 8.0):
        watch = Watch([condition])
        watch.spans = [span]
        assert 0.4 < watch.settle(0.0, [0.0, 1.0]) <= 1.0


def test_what_stands_still_is_never_looked_at_again() -> None:
    (condition,) = compile_condition(parse("cos(x) - 2"), Layout({"x": 2}, {}), at_zero=True)
    assert Watch([condition]).settle(0.0, [0.3, 0.0]) == math.inf


@pytest.mark.slow
@pytest.mark.parametrize("width", [0.05, 1e-3, 1e-5])
def test_a_narrow_bell_is_crossed_twice_and_its_area_is_not_lost(width: float) -> None:
    bell = f"exp(-((t - 7.3) / {width}) ** 2)"
    system = System(
        states={"x": 0.0},
        discrete={"rises": 0, "falls": 0, "at": 0},
        equations={"x": f"{bell} / {width}"},
        events=[
            When(f"{bell} crosses 0.5 rising", rises="rises + 1", at="t"),
            When(f"{bell} crosses 0.5 falling", falls="falls + 1"),
        ],
        outputs=["rises", "falls", "at", "x"],
        quantum=1e-3,
        horizon_s=100.0 * width,
    )
    _, values = solve(system, times=[20.0])
    assert (values["rises"], values["falls"]) == ([1.0], [1.0])
    half = width * math.sqrt(math.log(2.0))
    assert values["at"][0] == pytest.approx(7.3 - half, abs=3e-9)
    assert values["x"][0] == pytest.approx(math.sqrt(math.pi), abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["QSS2", "QSS3", "LIQSS2"])
@pytest.mark.parametrize(
    ("event", "in_20_s"),
    [
        ("sin(40 * x) > 0.95", 128),  # once for every tau / 40 of x
        ("sin(40 * x) * cos(x) > 0.9", None),
        ("sin(9 * t) * sin(10 * t) > 0.97", None),
        ("exp(30 * (cos(5 * x) - 1)) > 0.5", 15),
        ("tanh(50 * sin(3 * x)) > 0.999", 10),
        ("atan(20 * sin(3 * x)) > 1.5", 10),
        ("sqrt(1.01 + sin(7 * x)) < 0.12", None),
        ("1 / (1.001 + sin(7 * x)) > 500", None),
        ("x * x * x * sin(5 * x) > 2000", None),
    ],
)
def test_functions_of_a_state_cross_as_often_as_a_fine_grid_says(
    event: str, in_20_s: int | None, method: str
) -> None:
    """The state x is t, to the rounding of a float."""
    number = crossings_on_a_grid(event)
    assert in_20_s is None or number == in_20_s
    options = {"equations": {"x": "1"}, "method": method, "quantum": 1e-3}
    assert counted(event, 20.0, **options) == number


def test_a_product_with_an_angle_below_zero_is_bounded_by_its_magnitude() -> None:
    event = "(atan2(sin(x), cos(x)) - 10) * sin(7 * x) > 12"
    assert counted(event, 7.0, equations={"x": "1"}) == 2.0  # at 3.31 s and at 4.25 s


@pytest.mark.slow
def test_a_release_near_the_largest_force_is_found_at_its_instant() -> None:
    """As of a mass that sticks: the force is over its limit for a short while in each period."""
    for static in (9.0, 9.9, 9.999, 9.99999):
        system = System(
            states={"x": 0.0},
            discrete={"n": 0, "at": 0},
            definitions={"force": "10 * sin(2 * t) - x"},
            equations={"x": "0"},
            method="QSS3",
            quantum=1e-6,
            events=[When(f"force crosses {static} rising", n="n + 1", at="t if n == 0 else at")],
            outputs=["n", "at"],
        )
        _, values = solve(system, times=[100 * math.pi])
        assert values["n"] == [100.0]
        assert values["at"][0] == pytest.approx(0.5 * math.asin(static / 10.0), abs=5e-9)


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_the_first_second_is_the_same_however_long_one_solves(method: str) -> None:
    system = System(
        states={"x": 1.0, "v": 0.0, "y": 0.0},
        discrete={"n": 0},
        inputs={"u": Sine("u", 1.0)},
        equations={"x": "v", "v": "-sin(x) + 0.1 * u", "y": "exp(-t) * cos(9 * t)"},
        method=method,
        quantum=1e-2,
        events=[When("u + 0.01 * x > 0.9", n="n + 1")],
        outputs=["x", "v", "y", "n", "u"],
    )
    times = [0.1 * tick for tick in range(11)]
    first = solve(system, times=times)[1]
    longer = solve(system, times=[*times, 3.0])[1]
    assert {name: each[:11] for name, each in longer.items()} == first
    assert solve(system, until=1.0, samples=11)[1]["n"] == first["n"]
