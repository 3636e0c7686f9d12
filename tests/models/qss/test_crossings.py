import math
import random
from fractions import Fraction

import pytest

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.models.qss import Crossing, Segment, Simulation, System, When, solve
from firmware_runtime.models.qss.segment import whole_after
from firmware_runtime.models.qss.watch import (
    falls_below_zero,
    leaves_band,
)


class Watched:
    """A crossing of `x` alone, fed from outside."""

    def __init__(self, expression: str = "x") -> None:
        top = Coupled("top")
        crossing = top.add(Crossing("crossing", expression, ["x"]))
        self.entrance = top.in_port("x", Segment)
        top.couple(self.entrance, crossing.inputs["x"])
        self.simulator = Simulator(top, checked=True)
        self.events: list[tuple[int, bool]] = []
        self.sides: list[float] = []
        self.simulator.listen(crossing.event, lambda at, rises: self.events.append((at, rises)))
        self.simulator.listen(crossing.out, lambda _at, side: self.sides.append(side.value))

    def feed(self, at: int, *coefficients: float) -> None:
        self.simulator.inject(self.entrance, Segment(*coefficients))
        self.simulator.advance(at)


def first_crossing(coefficients: tuple[float, ...], until: int) -> int | None:
    """In whole ns, from exact arithmetic: the first at which the sign has changed."""
    exact = [Fraction(each) for each in coefficients]

    def is_above(at: int) -> bool:
        t = Fraction(at, SECOND)
        return sum(each * t**power for power, each in enumerate(exact)) > 0

    above = is_above(0)
    step = SECOND // 50
    for end in range(step, until + 1, step):
        if is_above(end) is not above:
            before, after = end - step, end
            while after - before > 1:
                middle = (before + after) // 2
                before, after = (middle, after) if is_above(middle) is above else (before, middle)
            return after
    return None


@pytest.mark.slow
@pytest.mark.parametrize("degree", [1, 2, 3])
def test_a_polynomial_crosses_zero_at_the_very_nanosecond(degree: int) -> None:
    generator, found = random.Random(degree), 0  # noqa: S311
    for _ in range(60):
        coefficients = tuple(generator.uniform(-3.0, 3.0) for _ in range(degree + 1))
        expected = first_crossing(coefficients, 5 * SECOND)
        watched = Watched()
        watched.feed(0, *coefficients)
        watched.simulator.run(5 * SECOND)
        if expected is None:
            continue
        found += 1
        at, rises = watched.events[0]
        assert abs(at - expected) <= 1
        assert rises is (coefficients[0] < 0.0)
    assert found > 15


def test_both_sides_are_sent_and_each_crossing_once() -> None:
    watched = Watched()
    watched.feed(0, -1.0, 3.0, -2.0)  # above zero between 0.5 s and 1 s
    watched.simulator.run(3 * SECOND)
    assert watched.events == [(SECOND // 2, True), (SECOND, False)]
    assert watched.sides == [0.0, 1.0, 0.0]


def test_a_jump_over_zero_is_a_crossing_at_that_instant() -> None:
    watched = Watched()
    watched.feed(0, -1.0)
    watched.feed(SECOND, 2.0)
    assert watched.events == [(SECOND, True)]


def test_a_jump_over_zero_is_a_crossing_though_the_value_goes_back_from_there() -> None:
    watched = Watched()
    watched.feed(0, -1.0)
    for at_s in (1, 3):
        watched.feed(at_s * SECOND, 1.0, -1.0)
        watched.simulator.run((at_s + 1) * SECOND)
    assert watched.events == [(at_s * SECOND, at_s % 2 == 1) for at_s in (1, 2, 3, 4)]


@pytest.mark.parametrize(("before", "events"), [(-1.0, [(SECOND, True)]), (1.0, [])])
def test_a_value_that_comes_to_stand_at_zero_is_above_it(
    before: float, events: list[tuple[int, bool]]
) -> None:
    watched = Watched()
    watched.feed(0, before)
    watched.feed(SECOND, 0.0)
    assert watched.events == events


def test_a_value_that_stood_at_zero_from_the_start_crosses_it_where_it_jumps_below() -> None:
    watched = Watched()
    watched.feed(0, 0.0)
    watched.feed(SECOND, -1.0)
    assert watched.events == [(SECOND, False)]


def test_a_value_that_touches_zero_and_turns_back_has_not_crossed() -> None:
    watched = Watched()
    watched.feed(0, 1.0, -2.0, 1.0)
    watched.simulator.run(3 * SECOND)
    assert watched.events == []


@pytest.mark.parametrize(
    ("expression", "at_s"),
    [
        ("sin(t) - 0.5 + 0 * x", math.pi / 6),
        ("x * x * x * x - 2", 2**0.25),
        ("exp(x) - 20", math.log(20)),
    ],
)
def test_a_function_without_exact_roots_crosses_within_two_nanoseconds(
    expression: str, at_s: float
) -> None:
    watched = Watched(expression)
    watched.feed(0, 0.0, 1.0)
    watched.simulator.run(4 * SECOND)
    ((at, rises), *_) = watched.events
    assert rises
    assert abs(at - at_s * SECOND) <= 2.0


BALL = {"x": "v", "v": "-9.81"}
BOUNCE = When("x crosses 0 falling", v="-0.8 * v")


@pytest.mark.parametrize(("method", "slack_ns"), [("QSS2", 3.0), ("QSS3", 3.0), ("LIQSS2", 30.0)])
def test_a_ball_bounces_where_it_must(method: str, slack_ns: float) -> None:
    bounce = When("x crosses 0 falling", v="-0.8 * v", n="n + 1")
    ball = System({"x": 1.0, "v": 0.0}, BALL, method, 1e-3, discrete={"n": 0}, events=[bounce])
    simulation, bounces = Simulation(ball), list[int]()
    count = simulation.model.out_ports["n"]
    simulation.simulator.listen(count, lambda at, _number: bounces.append(at))
    simulation.advance(3 * SECOND)
    assert bounces.pop(0) == 0  # as it was sent at first
    fall_s = math.sqrt(2.0 / 9.81)
    at_s = fall_s
    for number, at in enumerate(bounces):
        assert at == pytest.approx(at_s * SECOND, abs=slack_ns * (number + 1))
        at_s += 2.0 * fall_s * 0.8 ** (number + 1)
    assert len(bounces) == 6


@pytest.mark.parametrize("share", [0.9, 0.5, 0.1])
def test_bounces_without_end_are_an_error_and_the_ball_does_not_fall_through(share: float) -> None:
    event = When("x crosses 0 falling", v=f"-{share} * v")
    simulation = Simulation(System({"x": 1.0, "v": 0.0}, BALL, "QSS2", 1e-3, events=[event]))
    with pytest.raises(ModelError, match="ever faster"):
        simulation.advance(10 * SECOND)


def test_an_expression_changes_where_its_condition_does() -> None:
    ramp = System({"x": -1.0, "y": 0.0}, {"x": "1", "y": "abs(x) + (2 if x > 0.5 else 0)"})
    _, values = solve(ramp, 2.0, samples=3)
    assert values["y"][1:] == pytest.approx([0.5, 1.0 + 2.0 * 0.5], abs=1e-3)


def test_leaving_a_band_is_found_for_lines_parabolas_and_cubics() -> None:
    generator = random.Random(5)  # noqa: S311
    for _ in range(300):
        a, b, c, d = (generator.uniform(-1.0, 1.0) for _ in range(4))
        for found, second, third in (
            (leaves_band(1.0, a, b), 0.0, 0.0),
            (leaves_band(1.0, a, b, c), c, 0.0),
            (leaves_band(1.0, a, b, c, d), c, d),
        ):

            def value(
                t: float, a: float = a, b: float = b, c: float = second, d: float = third
            ) -> float:
                return abs(a + t * (b + t * (c + t * d)))

            assert value(found) == pytest.approx(1.0, abs=1e-9)
            assert max(value(found * share / 200) for share in range(200)) <= 1.0 + 1e-12


def test_a_duration_is_a_whole_number_of_nanoseconds_and_none_is_none() -> None:
    assert [whole_after(each) for each in (-1.0, 0.0, 1e-12, 3e-9, 3.2e-9)] == [0, 0, 1, 3, 4]
    assert whole_after(math.inf) == NEVER


def test_a_fall_below_zero_is_found_or_is_not_there() -> None:
    assert falls_below_zero(1.0, -1.0) == 1.0
    assert falls_below_zero(-1.0, 1.0) == math.inf
    assert falls_below_zero(0.0, -1.0) == 0.0
    assert falls_below_zero(0.0, 0.0, -1.0) == 0.0
    assert falls_below_zero(0.0, 0.0) == math.inf
    assert falls_below_zero(-1.0, 3.0, -2.0) == 1.0
    assert falls_below_zero(1.0, 0.0, 0.0, -1.0) == pytest.approx(1.0)
    assert falls_below_zero(-1.0, -1.0, 5.0) == 0.0
    assert falls_below_zero(-1.0, 2.0, -2.0) == 0.5  # where it turns back
    assert falls_below_zero(-1.0, 1.0, -1.0, 0.1) == pytest.approx(0.5445, abs=1e-4)
    assert falls_below_zero(-1.0, 0.0, 1.0, -1.0) == pytest.approx(2.0 / 3.0)
    assert falls_below_zero(-1.0, 0.0, 0.0, -1.0) == 0.0
    assert falls_below_zero(1.0, -1.0, -1.0, 1.0) == math.inf  # touches zero at 1
    assert falls_below_zero(-1e-200, 1e-170, 1e-200) == math.inf  # its discriminant is no float


@pytest.mark.parametrize("restitution", [0.8, 0.05])
@pytest.mark.parametrize("floor", ["0", "0.001"])
@pytest.mark.parametrize("method", ["QSS1", "QSS2", "QSS3", "LIQSS2"])
def test_a_ball_that_bounces_at_its_event_does_not_cross_the_floor_again(
    method: str, floor: str, restitution: float
) -> None:
    def solved(crosses: str) -> dict[str, list[float]]:
        ball = System(
            states={"x": 3.7, "v": 0.0},
            discrete={"bounces": 0},
            equations={"x": "v", "v": "-9.81"},
            method=method,
            quantum=1e-2,
            events=[When(crosses, v=f"-{restitution}*v", bounces="bounces + 1")],
            outputs=["x", "v", "bounces"],
        )
        return solve(ball, times=[0.8, 0.9])[1]

    found = solved(f"x crosses {floor}")
    assert found == solved(f"x crosses {floor} falling")
    assert found["bounces"] == [0.0, 1.0]


@pytest.mark.parametrize("method", ["QSS1", "QSS2", "QSS3", "LIQSS2"])
def test_an_event_that_lets_the_value_pass_is_followed_by_one_of_the_way_back(method: str) -> None:
    system = System(
        states={"x": 1.0},
        discrete={"rate": -1, "crossed": 0},
        equations={"x": "rate"},
        method=method,
        events=[
            When("x crosses 0", crossed="crossed + 1"),
            When("x crosses -0.5 falling", rate=1),
        ],
        outputs=["x", "crossed"],
    )
    _, values = solve(system, times=[0.9, 1.4, 1.9, 2.5])
    assert values["crossed"] == [0.0, 1.0, 1.0, 2.0]


@pytest.mark.parametrize("method", ["QSS1", "QSS2", "QSS3", "LIQSS2"])
@pytest.mark.parametrize(
    ("becomes", "rises", "falls"),
    [("x > 0", 1.0, 0.0), ("x < 0", 0.0, 1.0), ("x >= 0", 1.0, 0.0), ("x <= 0", 0.0, 1.0)],
)
def test_a_comparison_of_what_stood_at_the_limit_becomes_true_where_it_leaves_it(
    becomes: str, rises: float, falls: float, method: str
) -> None:
    for rate, expected in ((1, rises), (-1, falls)):
        system = System(
            states={"x": 0.0},
            discrete={"rate": 0, "n": 0},
            equations={"x": "rate"},
            method=method,
            events=[When("t >= 1", rate=rate), When(becomes, n="n + 1")],
            outputs=["n"],
        )
        assert solve(system, times=[0.9, 2.0])[1]["n"] == [0.0, expected]


@pytest.mark.parametrize("method", ["QSS1", "QSS2", "QSS3", "LIQSS2"])
@pytest.mark.parametrize("push", [1, -1])
@pytest.mark.parametrize("stops", ["v < 0", "v <= 0", "v crosses 0 falling", "v crosses 0"])
def test_a_body_that_was_brought_to_rest_by_an_event_leaves_without_another(
    stops: str, push: int, method: str
) -> None:
    system = System(
        states={"v": 1.0},
        discrete={"force": -1, "stops": 0},
        equations={"v": "force"},
        method=method,
        events=[When(stops, v=0, force=0, stops="stops + 1"), When("t >= 2", force=push)],
        outputs=["v", "stops"],
    )
    _, values = solve(system, times=[1.5, 3.0])
    assert values["v"] == pytest.approx([0.0, push], abs=1e-2)
    assert values["stops"] == [1.0, 1.0]


@pytest.mark.parametrize("method", ["QSS1", "QSS2", "QSS3", "LIQSS2"])
@pytest.mark.parametrize(
    "touches",
    [
        "(t - 1)**4",
        "-(t - 1/3)**4",
        "1e9*(x - 1)**4",
        "sin(t)**4",
        "abs(x - 2)",
    ],
)
def test_a_function_that_touches_zero_and_turns_back_has_not_crossed(
    touches: str, method: str
) -> None:
    system = System(
        states={"x": 0.0},
        discrete={"n": 0},
        equations={"x": "1"},
        method=method,
        events=[When(f"{touches} crosses 0", n="n + 1")],
        outputs=["n"],
    )
    assert solve(system, times=[10.0])[1]["n"] == [0.0]


@pytest.mark.parametrize("method", ["QSS1", "QSS2", "QSS3", "LIQSS2"])
def test_a_ball_that_is_stopped_by_another_at_the_same_instant_has_hit_once(method: str) -> None:
    """Newton's cradle: the first ball hits the second, which lies against the third."""
    cradle = System(
        states={"a": 0.0, "b": 1.0, "c": 1.0, "va": 1.0, "vb": 0.0, "vc": 0.0},
        discrete={"hits": 0},
        equations={"a": "va", "b": "vb", "c": "vc", "va": "0", "vb": "0", "vc": "0"},
        method=method,
        events=[
            When("a crosses b rising", va="vb", vb="va", hits="hits + 1"),
            When("b crosses c rising", vb="vc", vc="vb", hits="hits + 1"),
        ],
        outputs=["hits", "va", "vb", "vc"],
    )
    _, values = solve(cradle, times=[3.0])
    assert values == {"hits": [2.0], "va": [0.0], "vb": [0.0], "vc": [1.0]}
