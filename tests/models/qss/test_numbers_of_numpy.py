"""Numbers of numpy, as programs have them, give what plain numbers give; others are refused."""

from typing import Any

import numpy as np
import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.models.qss import System, solve


def test_numbers_of_numpy_give_the_values_of_plain_ones() -> None:
    equations = {"x": "v", "v": "k*(1 - x*x)*v - x"}
    plain = System(
        states={"x": 2.0, "v": 0.0}, equations=equations, quantum=1e-3, parameters={"k": 2.0}
    )
    theirs = System(
        states={"x": np.float64(2.0), "v": np.float64(0.0)},
        equations=equations,
        quantum=np.float64(1e-3),
        parameters={"k": np.float64(2.0)},
    )
    at, values = solve(theirs, times=list(np.linspace(0.0, 3.0, 7)))
    assert (at, values) == solve(plain, until=3.0, samples=7)
    assert {type(each) for each in (*at, *values["x"])} == {float}


@pytest.mark.parametrize(
    "wrong",
    [
        {"quantum": "1"},
        {"quantum": None},
        {"quantum": float("nan")},
        {"relative_quantum": "1"},
        {"parameters": {"k": 10**400}},
        {"horizon_s": "1"},
    ],
)
def test_what_is_no_number_of_a_system_is_refused_by_a_sentence(wrong: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match="expected"):
        solve(System(states={"x": 1.0}, equations={"x": "-x"}, **wrong), until=1.0)


@pytest.mark.parametrize(
    ("until", "samples"), [(1e300, 3), ("1", 3), (float("nan"), 3), (1.0, 2.5), (1.0, 1)]
)
def test_instants_that_are_none_are_refused_by_a_sentence(until: float, samples: int) -> None:
    with pytest.raises(ConfigError, match="expected"):
        solve(System(states={"x": 1.0}, equations={"x": "-x"}), until=until, samples=samples)
