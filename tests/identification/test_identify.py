"""Identification of made-up runs whose truth is known; the share of 200 plants is a benchmark."""

from dataclasses import replace

import numpy as np
import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.identification.identified import identify
from firmware_runtime.lab.identification.noise import noise_of
from firmware_runtime.lab.identification.plant import Numbers, PlantParameters
from firmware_runtime.lab.identification.recorded_series import Quantity, Series, checked
from firmware_runtime.lab.identification.regression import guesses
from tests.support.pushed_body import pushed_body

PLANT = PlantParameters(0.075, 0.05, 0.03, 0.05, 0.043)
LAG_S = 0.03
AT = np.arange(1500) * 0.01
GIVEN = np.where(AT < 8.0, 0.11 * np.sin(2.0 * AT), 0.3 * np.sign(np.sin(5.0 * AT)))


def run(
    quantity: Quantity, given: Numbers = GIVEN, *, lag_s: float = LAG_S, correlation: float = 0.0
) -> Series:
    position, rate = pushed_body(PLANT, lag_s, AT, given)
    truth = rate if quantity == "rate" else position
    random = np.random.default_rng(7)
    noise = random.normal(0.0, 0.01 * truth.std(), len(AT))
    for place in range(1, len(noise)):
        noise[place] += correlation * noise[place - 1]
    return Series(AT, given, AT, truth + noise + 0.2, quantity)


@pytest.mark.slow
@pytest.mark.parametrize("quantity", ["rate", "position"])
def test_all_five_are_found_from_rates_or_from_positions(quantity: Quantity) -> None:
    identified, _ = identify(run(quantity), "rotation", LAG_S)
    for each, truth in zip(identified.parameters.values(), PLANT.values, strict=True):
        assert each.value == pytest.approx(truth, rel=0.15)
        assert each.low is not None
        assert each.high is not None
        apart = 0.5 * (each.high - each.low)
        assert abs(each.value - truth) < 2.0 * apart  # four deviations
    assert identified.offset == pytest.approx(0.2, abs=0.01)
    assert identified.explained > 0.99
    assert identified.warnings == []


@pytest.mark.slow
def test_noise_that_shares_its_values_widens_the_intervals() -> None:
    white, _ = identify(run("rate"), "rotation", LAG_S)
    shared, _ = identify(run("rate", correlation=0.8), "rotation", LAG_S)
    assert shared.noise == pytest.approx(white.noise, rel=0.05)
    assert shared.noise_weights[0] == pytest.approx(0.8, abs=0.1)
    for one, other in zip(white.parameters.values(), shared.parameters.values(), strict=True):
        assert other.high is not None
        assert one.high is not None
        assert other.high - (other.low or 0.0) > 1.5 * (one.high - (one.low or 0.0))


@pytest.mark.slow
def test_a_static_friction_that_steps_of_the_input_jump_over_is_bounded_by_them() -> None:
    given = 0.3 * np.sign(np.sin(5.0 * AT))
    identified, _ = identify(run("rate", given, lag_s=0.0), "rotation", 0.0)
    static = identified.parameters["static_friction_nm"]
    assert static.holds(PLANT.static)
    assert static.high is not None
    assert static.high == pytest.approx(0.3, rel=0.05)


@pytest.mark.slow
def test_a_body_that_moves_at_the_first_measurement_is_identified_too() -> None:
    identified, _ = identify(run("rate").since(1.2), "rotation", LAG_S)
    assert identified.parameters["inertia_kg_m2"].value == pytest.approx(PLANT.inertia, rel=0.02)


@pytest.mark.slow
def test_an_interval_holds_the_truth_and_not_what_is_far_from_it() -> None:
    identified, _ = identify(run("rate"), "translation", LAG_S)
    mass = identified.parameters["mass_kg"]
    assert mass.holds(mass.value)
    assert not mass.holds(0.5 * PLANT.inertia)
    assert not mass.holds(2.0 * PLANT.inertia)


def test_regression_alone_comes_near_without_a_derivative() -> None:
    found = guesses(run("rate"), LAG_S)[0].plant
    assert found.inertia == pytest.approx(PLANT.inertia, rel=0.1)
    assert found.damping == pytest.approx(PLANT.damping, rel=0.3)
    assert found.delay_s == pytest.approx(PLANT.delay_s, abs=0.02)


def test_white_noise_has_no_weights_and_an_autoregression_its_own() -> None:
    white = np.random.default_rng(3).normal(size=3000)
    assert len(noise_of(white).weights) == 0
    values = white.copy()
    for place in range(2, len(values)):
        values[place] += 0.5 * values[place - 1] - 0.3 * values[place - 2]
    found = noise_of(values)
    assert found.weights == pytest.approx([0.5, -0.3], abs=0.05)
    assert found.whitened(values) == pytest.approx(white[2:], abs=0.5)


def test_every_fault_of_a_series_is_named() -> None:
    sound = run("rate")
    few = replace(sound, at=sound.at[:10], measured=sound.measured[:10], given=sound.given * 0.0)
    with pytest.raises(ConfigError) as refused:
        checked(few, "run.csv")
    assert len(refused.value.faults) == 2
    with pytest.raises(ConfigError, match="not finite"):
        checked(replace(sound, measured=np.where(sound.at > 3, np.nan, 0.0)), "run.csv")
    with pytest.raises(ConfigError, match="ascend"):
        checked(replace(sound, at=sound.at[::-1]), "run.csv")
    with pytest.raises(ConfigError, match="an output that never changes"):
        checked(replace(sound, measured=sound.measured * 0.0), "run.csv")


@pytest.mark.slow
def test_an_output_that_has_nothing_of_its_input_bounds_no_number() -> None:
    at = np.arange(300) * 0.01
    given = np.where(at % 2.0 < 1.0, 0.0, 0.1)
    measured = np.random.default_rng(20).normal(0.0, 1.0, len(at))
    identified, _ = identify(Series(at, given, at, measured, "rate"), "rotation", LAG_S)
    assert all(each.high is None for each in identified.parameters.values())
    assert identified.explained < 0.1
    assert identified.warnings
