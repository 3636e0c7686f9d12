"""Numbers of numpy, as programs have them, give what plain numbers give."""

import numpy as np

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
