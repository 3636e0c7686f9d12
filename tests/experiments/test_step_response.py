"""The figures of a step response, on curves whose figures are known."""

from math import cos, exp, log, pi, sin, sqrt

import pytest

from firmware_runtime.lab.experiments.curve_figures import (
    difference,
    step_response,
    value_at,
)


def second_order(damping: float, at: float) -> float:
    """The unit step response of a damped oscillator of 1 rad/s."""
    frequency = sqrt(1 - damping * damping)
    swing = cos(frequency * at) + damping / frequency * sin(frequency * at)
    return 1 - exp(-damping * at) * swing


TIMES = [number / 1000 for number in range(30_001)]


def test_of_a_first_order_lag() -> None:
    found = step_response([(at, 1 - exp(-at)) for at in TIMES], 0.0, 1.0)
    assert found.rise_s == pytest.approx(log(9), abs=1e-3)
    assert found.overshoot == 0.0
    assert found.settling_s == pytest.approx(log(20), abs=2e-3)
    assert found.final == pytest.approx(1.0)


def test_of_a_damped_oscillator() -> None:
    found = step_response([(at, 2 - 3 * second_order(0.5, at)) for at in TIMES], 2.0, -1.0)
    assert found.overshoot == pytest.approx(exp(-pi * 0.5 / sqrt(0.75)), abs=1e-4)
    assert found.rise_s == pytest.approx(1.638, abs=2e-3)


def test_what_never_happened_is_not_a_number() -> None:
    found = step_response([(-1.0, 0.0), (0.5, 0.05), (1.0, 0.3)], 0.0, 1.0)
    assert (found.rise_s, found.overshoot, found.settling_s) == (None, None, None)
    assert found.samples == 2
    assert step_response([(-1.0, 0.0)], 0.0, 1.0).final is None


@pytest.mark.parametrize("there", [0.9, 1.0, 9.25])
def test_what_was_at_the_end_or_beyond_before_the_step_did_not_rise_to_it(there: float) -> None:
    found = step_response([(0.0, there), (1.0, there)], 0.0, 1.0)
    assert (found.rise_s, found.overshoot, found.final) == (None, None, there)


def test_one_that_leaves_its_band_again_has_not_settled() -> None:
    found = step_response([(0.0, 0.0), (1.0, 1.0), (2.0, 1.2)], 0.0, 1.0)
    assert found.settling_s is None


def test_the_difference_of_curves_with_other_instants() -> None:
    line = [(at / 10, at / 10) for at in range(-5, 11)]
    above = [(at / 10 + 0.05, at / 10 + 0.15) for at in range(10)]
    apart = difference(above, line)
    assert apart is not None
    assert apart.rms == pytest.approx(0.1)
    assert apart.largest == pytest.approx(0.1)
    assert difference(above, [(20.0, 1.0), (21.0, 1.0)]) is None


def test_a_curve_has_no_value_beyond_its_ends() -> None:
    points = [(0.0, 1.0), (2.0, 3.0)]
    assert [value_at(points, at) for at in (-0.1, 0.0, 1.0, 2.0, 2.1)] == [
        None,
        1.0,
        2.0,
        3.0,
        None,
    ]
