from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as some
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from firmware_runtime.models.plant import SecondOrderPlant, ramp

numbers = some.floats(-3.0, 3.0)


@pytest.mark.slow
@given(
    some.tuples(numbers, numbers, numbers),
    some.floats(0.5, 5.0),
    some.one_of(some.just(0.0), some.floats(1e-4, 5.0)),
    some.floats(0.01, 0.5),
)
def test_the_closed_form_is_what_integration_of_its_equations_gives(
    state: tuple[float, float, float], gain: float, damping: float, lag_s: float
) -> None:
    def slopes(_t: float, at: NDArray[np.float64]) -> list[float]:
        _, rate, drive = at
        return [rate, drive - damping * rate, (gain * 0.7 - drive) / lag_s]

    plant = SecondOrderPlant(gain, damping, lag_s)
    expected = solve_ivp(slopes, (0.0, 0.4), state, rtol=1e-10, atol=1e-12).y[:, -1]
    assert plant.after(state, 0.7, 0.4) == pytest.approx(expected, rel=1e-7, abs=1e-8)


@pytest.mark.parametrize("damping", [0.0, 1e-9, 2.0, 50.0])
def test_two_steps_are_one_where_damping_meets_lag_or_is_none(damping: float) -> None:
    plant = SecondOrderPlant(5.0, damping, lag_s=0.02)
    halfway = plant.after(plant.rest, 1.0, 0.05)
    assert plant.after(halfway, 1.0, 0.03) == pytest.approx(plant.after(plant.rest, 1.0, 0.08))


@pytest.mark.parametrize("a", [1e-6, 9.9e-4, 1.1e-3])
def test_the_way_under_little_damping_is_exact_to_a_billionth(a: float) -> None:
    z = Decimal(a)
    exact = (z - 1 + (-z).exp()) / (z * z)
    assert ramp(a, 1.0) == pytest.approx(float(exact), rel=1e-9)


def test_without_lag_the_command_acts_at_once() -> None:
    assert SecondOrderPlant(2.0).after((1.0, 0.5, 0.0), 1.0, 0.1) == pytest.approx((1.06, 0.7, 2.0))


def test_every_number_that_is_none_of_a_plant_is_named() -> None:
    with pytest.raises(ValueError, match=r"gain is 0.*damping_per_s is -1.*lag_s is nan"):
        SecondOrderPlant(0.0, -1.0, float("nan"))
