"""Identification from positions alone: found from afar, sure of itself as far as it may be."""

from dataclasses import replace
from typing import Final

import numpy as np
import pytest

from firmware_runtime.lab.identification.identified import identify
from firmware_runtime.lab.identification.noise import WHITE, noise_of, random_walk
from firmware_runtime.lab.identification.plant import Numbers, PlantParameters
from firmware_runtime.lab.identification.profile import Profile
from firmware_runtime.lab.identification.recorded_series import Series
from firmware_runtime.lab.identification.regression import guesses
from firmware_runtime.lab.identification.search import EXCESS, OutputError, Search
from tests.support.drawn_plants import LAG_S, drawn
from tests.support.pushed_body import pushed_body

CART_LAG_S: Final = 0.05
CART: Final = PlantParameters(2.0, 1.5, 0.8, 1.2, 0.06)
AT: Final = np.arange(1200) * 0.02
GIVEN: Final = np.where(AT < 12.0, 2.0 * np.sin(1.5 * AT), 3.5 * np.sign(np.sin(4.0 * AT)))


def cart(given: Numbers = GIVEN, *, noise: float = 0.01) -> Series:
    """A cart's place by a camera at 30 Hz that misses one picture of five."""
    random = np.random.default_rng(4)
    seen = np.arange(700) / 30.0
    seen = seen[random.uniform(size=len(seen)) > 0.2]
    among = np.unique(np.concatenate((AT, seen)))
    held = given[np.searchsorted(AT, among, side="right") - 1]
    position, _ = pushed_body(CART, CART_LAG_S, among, held)
    place = position[np.searchsorted(among, seen)]
    return Series(AT, given, seen, place + random.normal(0.0, noise, len(seen)), "position")


def sprung(series: Series) -> Series:
    """What the cart's place would be at a spring, by small steps."""
    place, rate, found = 0.0, 0.0, []
    for at in np.arange(0.0, series.at[-1] + 0.001, 0.001):
        pushed = float(GIVEN[np.searchsorted(AT, at, side="right") - 1])
        rate += 0.001 * (pushed - CART.damping * rate - 12.0 * place) / CART.inertia
        place += 0.001 * rate
        found.append(place)
    measured = np.interp(series.at, np.arange(len(found)) * 0.001, found)
    noise = np.random.default_rng(5).normal(0.0, 0.01, len(measured))
    return replace(series, measured=measured + noise)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 9])
def test_a_plant_is_found_although_its_slopes_are_lost_in_noise(seed: int) -> None:
    case = drawn(seed, "position")
    identified, found = identify(case.series, "rotation", LAG_S)
    assert not found.wanders
    assert identified.parameters["inertia_kg_m2"].value == pytest.approx(
        case.plant.inertia, rel=0.03
    )
    for each, truth in zip(identified.parameters.values(), case.plant.values, strict=True):
        assert each.holds(truth)


@pytest.mark.slow
def test_a_cart_is_found_by_a_camera_that_misses_pictures() -> None:
    identified, _ = identify(cart(), "translation", CART_LAG_S)
    assert identified.warnings == []
    for each, truth in zip(identified.parameters.values(), CART.values, strict=True):
        assert each.holds(truth)
        assert each.value == pytest.approx(truth, rel=0.3)


@pytest.mark.slow
def test_a_friction_that_positions_do_not_show_is_said_to_be_uncertain() -> None:
    given = 2.5 * np.sign(np.sin(4.0 * AT))
    identified, _ = identify(cart(given, noise=0.002), "translation", CART_LAG_S)
    static = identified.parameters["static_friction_n"]
    assert static.holds(CART.static)
    assert static.low is not None
    assert static.low < 0.8 * CART.static
    assert static.high is not None
    assert static.high < 2.5


@pytest.mark.slow
def test_a_plant_of_another_form_is_warned_of() -> None:
    identified, found = identify(sprung(cart()), "translation", CART_LAG_S)
    assert found.wanders
    assert any("no noise" in each for each in identified.warnings)


@pytest.mark.slow
def test_the_walk_over_static_friction_leaves_a_valley_that_is_not_the_deepest() -> None:
    series = cart()
    search = Search(
        OutputError(series, CART_LAG_S, begins_moving=False),
        np.array([2.0, 2.0, 0.2, 0.2, 0.01, float(np.std(series.measured))]),
    )
    truth = np.array([2.0, 1.5, 0.8, 0.4, 0.06, 0.0])
    wrong = truth.copy()
    wrong[EXCESS] = 0.9
    wrong = search.solved(WHITE, wrong, held=EXCESS)
    better = Profile(search, WHITE, wrong, 0.95).run()
    assert better is not None
    assert search.squares(WHITE, better) < search.squares(WHITE, wrong)
    assert abs(better[EXCESS] - 0.4) < abs(wrong[EXCESS] - 0.4)


@pytest.mark.slow
def test_slopes_over_some_span_come_near_to_the_plant() -> None:
    found = [each.plant for each in guesses(cart(), CART_LAG_S)]
    assert len(found) > 1
    assert min(abs(each.inertia / CART.inertia - 1.0) for each in found) < 0.1


def test_a_difference_in_a_value_that_a_search_ran_off_to_is_a_number() -> None:
    model = OutputError(cart(), CART_LAG_S, begins_moving=False)
    far = np.array([1e11, 1e11, 1e11, 0.4, 0.06, 1e11])
    steps = np.full(len(far), 1e-6)
    assert np.isfinite(model.jacobian(far, steps, np.arange(len(far)))).all()


def test_what_a_random_walk_leaves_is_its_change_over_a_span() -> None:
    values = np.array([1.0, 2.0, 4.0, 8.0])
    assert random_walk(2).whitened(values).tolist() == [3.0, 6.0]
    assert random_walk(0).whitened(values).tolist() == values.tolist()


def test_noise_is_remembered_for_as_long_as_it_is_alike() -> None:
    white = np.random.default_rng(2).normal(size=3000)
    assert noise_of(white).memory == pytest.approx(1.0)
    assert noise_of(np.cumsum(white)).memory > 50.0
