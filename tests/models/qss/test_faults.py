"""What a system gets wrong: refused by a sentence that names the part, before or while it runs."""

import math
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import LONGEST_S
from firmware_runtime.errors import ConfigError
from firmware_runtime.models.qss import Constant, FromFile, Step, System, When, solve

SOUND: dict[str, Any] = {"states": {"x": 1.0}, "equations": {"x": "-x"}}


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"states": ["x"]}, r"states is \['x'\]; expected a dictionary"),
        ({"states": {1: 1.0}}, "states: 1 is no name"),
        ({"equations": None}, "equations is None; expected a dictionary"),
        ({"equations": {"x": -1.0}}, "equations: x is -1.0; expected an expression as text"),
        ({"definitions": {"a": 2}}, "definitions: a is 2; expected an expression as text"),
        ({"events": When("x crosses 0", x=1)}, "events is .*; expected a list of When"),
        ({"events": [When(5, x=1)]}, "events: 1: event is 5; expected an expression"),  # type: ignore[arg-type]
        ({"events": [When("x > 0", only_if=0, x=1)]}, "events: 1: only_if is 0; expected"),  # type: ignore[arg-type]
        ({"events": ["x crosses 0"]}, "events: 'x crosses 0'; expected a list of When"),
        ({"method": {"x": "QSS1"}}, "method is {'x': 'QSS1'}; expected one of QSS1"),
        ({"horizon_s": 0.0}, "horizon_s is 0.0; expected more than 0"),
        ({"horizon_s": math.inf}, "horizon_s is inf; expected more than 0"),
        ({"outputs": "x"}, "outputs is 'x'; expected a list"),
        ({"quantum": {"x": 1e-3, "y": 1e-3}}, "quantum: y is no state"),
        ({"relative_quantum": {"y": 1e-3}}, "relative_quantum: y is no state"),
        ({"parameters": {"e": 0.8}}, "parameters: 'e' has a meaning in expressions"),
        ({"parameters": {"lambda": 0.8}}, "parameters: 'lambda' has a meaning in expressions"),
        ({"parameters": {"x y": 0.8}}, "parameters: 'x y' is no name"),
        ({"equations": {"x": "1 / k"}, "parameters": {"k": 0}}, "equations: x: 1 / k: division"),
        ({"events": [When("1 / k > x", x=1)], "parameters": {"k": 0}}, "events: 1: 1 / k"),
    ],
)
def test_a_part_of_the_wrong_kind_or_name_is_named(wrong: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        solve(System(**{**SOUND, **wrong}), 1.0)


@pytest.mark.parametrize("method", ["QSS1", "QSS2", "QSS3", "LIQSS2"])
@pytest.mark.parametrize("text", ["sqrt(-x)", "1 / (x - 1)", "log(x - 1)", "exp(1000 * x)"])
def test_an_equation_without_a_value_names_itself_the_instant_and_its_inputs(
    text: str, method: str
) -> None:
    with pytest.raises(ModelError, match=r"system.x': .* has no value at 0.000000000 s, x = 1: "):
        solve(System(states={"x": 1.0}, equations={"x": text}, method=method), 1.0)


def test_an_event_without_a_value_names_its_expression_the_instant_and_its_inputs() -> None:
    for event in (When("1 / (x - 1) > 0", x=2), When("x crosses 0.5", x="sqrt(-x)")):
        with pytest.raises(ModelError, match=r"has no value at 0\.\d+ s, x = (1|0\.5): "):
            solve(System(**SOUND, events=[event]), 1.0)


@pytest.mark.parametrize("name", ["x", "n"])
def test_an_event_sets_no_state_and_no_discrete_value_beyond_all_numbers(name: str) -> None:
    event = When("x crosses 0.5", **{name: "1e308 * 10 * x"})
    with pytest.raises(ModelError, match=r"then 1: .* has no value at .*: it is inf; expected"):
        solve(System(**SOUND, discrete={"n": 0}, events=[event]), 1.0)


@pytest.mark.parametrize("times", [[1.0, 0.5], [-1.0, 0.5]])
def test_times_that_do_not_ascend_from_the_start_are_refused(times: list[float]) -> None:
    with pytest.raises(ConfigError, match="times do not ascend; expected instants from 0 s on"):
        solve(System(**SOUND), times=times)


@pytest.mark.parametrize("until", [0.0, -1.0, math.inf])
def test_a_solution_has_a_duration(until: float) -> None:
    with pytest.raises(ConfigError, match=f"until {until} s, 1001 samples; expected more than 0 s"):
        solve(System(**SOUND), until)


def test_a_solution_may_be_as_long_as_time_goes() -> None:
    assert solve(System({"x": 1.0}, {"x": "0"}), LONGEST_S, samples=2)[1]["x"] == [1.0, 1.0]
    with pytest.raises(ConfigError, match="1e\\+09 s at most"):
        solve(System(**SOUND), math.nextafter(LONGEST_S, math.inf))


def test_what_is_no_system_cannot_be_solved() -> None:
    with pytest.raises(ConfigError, match="expected a System"):
        solve({"x": "-x"}, 1.0)  # type: ignore[arg-type]  # the mistake


@pytest.mark.parametrize("value", ["nan", "inf", "x"])
def test_a_file_of_samples_is_refused_by_the_line_that_is_none(value: str, tmp_path: Path) -> None:
    path = tmp_path / "u.csv"
    path.write_text(f"t,u\n0,1\n1,{value}\n", encoding="utf-8")
    with pytest.raises(ModelError, match=f"line 3 is '1,{value}'; expected seconds and a value"):
        FromFile("u", path)


def test_a_file_of_samples_that_is_absent_or_no_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "u.csv"
    with pytest.raises(ModelError, match=r"cannot be read \(No such file or directory\); expected"):
        FromFile("u", path)
    path.write_bytes(b"t,\xff\n")
    with pytest.raises(ModelError, match="cannot be read: not UTF-8; expected a CSV file"):
        FromFile("u", path)


def test_a_source_that_sends_no_number_is_refused_before_it_is_read() -> None:
    for source in (Constant("u", math.nan), Step("u", 0.5, after=math.inf)):
        system = System(states={"x": 0.0}, equations={"x": "-x"}, inputs={"u": source})
        with pytest.raises(ModelError, match="expected finite numbers"):
            solve(system, until=1.0)


ROBERTSON: dict[str, Any] = {
    "states": {"a": 1.0, "b": 0.0, "c": 0.0},
    "equations": {
        "a": "-0.04*a + 1e4*b*c",
        "b": "0.04*a - 1e4*b*c - 3e7*b*b",
        "c": "3e7*b*b",
    },
    "method": "LIQSS2",
}


def test_what_a_quantum_too_large_for_its_state_lets_run_away_is_shown() -> None:
    with pytest.raises(ModelError, match=r"b = .*a smaller quantum"):
        solve(System(**ROBERTSON, quantum=1e-2), 1.0, samples=2)


def test_quanta_that_are_small_beside_their_states_solve_it() -> None:
    quanta = {"a": 1e-3, "b": 1e-8, "c": 1e-3}
    _, values = solve(System(**ROBERTSON, quantum=quanta), 40.0, samples=2)
    found = [values[name][1] for name in ("a", "b", "c")]
    assert found == pytest.approx([0.7158271, 9.1855e-6, 0.2841637], rel=2e-3)
