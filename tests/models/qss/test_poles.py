"""Where an expression has no value on the way, or jumps: denominators, tangents, angles."""

import math

import pytest

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.models.qss import System, When, solve

METHODS = ["QSS1", "QSS2", "QSS3", "LIQSS2"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "text", ["1/x", "1/(2*abs(x))", "x**-1", "tan(x - pi/2)", "(x + 1)/(-3*x*(x + 9))"]
)
def test_a_pole_that_is_passed_between_two_events_ends_the_solution(text: str, method: str) -> None:
    system = System(
        states={"x": 1.0, "y": 0.0}, equations={"x": "-1", "y": text}, method=method, quantum=1e-2
    )
    with pytest.raises(ModelError, match=r"has no value at [01].*goes through 0"):
        solve(system, until=2.0, samples=3)


@pytest.mark.parametrize("method", METHODS)
def test_a_root_of_what_runs_out_is_followed_up_to_the_instant_at_which_it_has_none(
    method: str,
) -> None:
    system = System(states={"y": 0.0}, equations={"y": "sqrt(1 - t)"}, method=method, quantum=0.1)
    with pytest.raises(ModelError, match=r"has no value at 1\.00000000[01] s"):
        solve(system, until=2.0, samples=2)


@pytest.mark.parametrize("method", ["QSS2", "QSS3", "LIQSS2"])
def test_a_state_that_runs_into_its_own_pole_ends_there_instead_of_chattering(method: str) -> None:
    system = System(states={"x": 1.0}, equations={"x": "-1/x"}, method=method)
    with pytest.raises(ModelError, match=r"has no value at 0\.500.*x goes through 0"):
        solve(system, until=2.0, samples=3)


@pytest.mark.parametrize("method", METHODS)
def test_a_denominator_that_is_set_to_the_other_side_has_passed_nothing(method: str) -> None:
    system = System(
        states={"x": 1.0, "y": 0.0},
        equations={"x": "0", "y": "1/x"},
        events=[When("t >= 1", x=-1)],
        method=method,
    )
    _, values = solve(system, times=[1.0, 3.0])
    assert values["y"] == pytest.approx([1.0, -1.0], abs=1e-2)


@pytest.mark.parametrize("method", METHODS)
def test_a_branch_that_keeps_away_from_a_pole_is_no_pole(method: str) -> None:
    text = "1/x if x > 0.1 else 10"
    system = System(states={"x": 1.0, "y": 0.0}, equations={"x": "-1", "y": text}, method=method)
    _, values = solve(system, times=[2.0])
    assert values["y"] == pytest.approx([10.0 * 1.1 + math.log(10.0)], abs=1e-2)


@pytest.mark.parametrize("method", ["QSS2", "QSS3", "LIQSS2"])
@pytest.mark.parametrize(
    ("states", "equations"),
    [
        ({"a": 0.0}, {"a": "atan2(sin(t), cos(t))"}),
        ({"s": 0.0, "c": 1.0, "a": 0.0}, {"s": "c", "c": "-s", "a": "atan2(s, c)"}),
    ],
)
def test_an_angle_jumps_at_the_instant_at_which_it_turns_round(
    states: dict[str, float], equations: dict[str, str], method: str
) -> None:
    system = System(states=states, equations=equations, method=method, quantum=1e-3, outputs=["a"])
    times = [2.0, math.pi, 4.0, 6.0]
    _, values = solve(system, times=times)
    turned = [0.5 * t * t - math.tau * max(t - math.pi, 0.0) for t in times]
    assert values["a"] == pytest.approx(turned, abs=0.02)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("root", ["sqrt(max(h, 0))", "max(h, 0)**0.5"])
def test_a_tank_that_has_run_empty_by_a_root_stays_empty(root: str, method: str) -> None:
    tank = System(states={"h": 1.0}, equations={"h": f"-0.1*{root}"}, method=method, quantum=1e-3)
    _, values = solve(tank, times=[10.0, 25.0])
    assert values["h"] == pytest.approx([0.25, 0.0], abs=1e-3)
