"""The simulated body beside TachoBot's world, which shares no line with it."""

import numpy as np
import pytest

from firmware_runtime.lab.identification.motion import Body, State, motion
from firmware_runtime.lab.identification.plant import Numbers, PlantParameters
from firmware_runtime.lab.identification.recorded_series import Series
from firmware_runtime.lab.identification.search import OutputError
from firmware_runtime.lab.identification.stretches import stretches_of
from sim_doubles.worlds.swing import Swing, Transient
from tests.support.pushed_body import pushed_body

AT = np.arange(600) * 0.01
SLOW = 0.12 * np.sin(2.0 * AT)
SQUARE = 0.3 * np.sign(np.sin(5.0 * AT))


@pytest.mark.parametrize("lag_s", [0.0, 0.03])
@pytest.mark.parametrize("given", [SLOW, SQUARE])
@pytest.mark.parametrize(
    "plant",
    [
        PlantParameters(0.07, 0.05, 0.02, 0.05, 0.0237),
        PlantParameters(0.2, 0.0, 0.03, 0.03, 0.04),
        PlantParameters(0.03, 0.9, 0.01, 0.05, 0.0),
    ],
)
def test_position_and_rate_are_those_of_an_exact_world(
    plant: PlantParameters, given: Numbers, lag_s: float
) -> None:
    position, rate = motion(plant, stretches_of(AT, given, AT, plant.delay_s, lag_s), 0.0)
    expected = pushed_body(plant, lag_s, AT, given)
    assert position == pytest.approx(expected[0], abs=2e-6)
    assert rate == pytest.approx(expected[1], abs=2e-6)


def test_a_plant_may_come_to_rest_within_a_stretch_a_thousand_times_over() -> None:
    plant = PlantParameters(1e-6, 0.5, 0.0, 0.0, 0.0)
    position, rate = motion(plant, stretches_of(AT, SQUARE, AT, 0.0, 0.03), 0.0)
    assert np.isfinite(position).all()
    assert rate[-1] == pytest.approx(SQUARE[-2] / plant.damping, rel=1e-3)


def test_steps_wider_than_the_inertia_leave_some() -> None:
    model = OutputError(Series(AT, SQUARE, AT, SQUARE, "rate"), 0.03, begins_moving=False)
    values = np.array([1e-4, 0.1, 0.01, 0.01, 0.02, 0.0])
    jacobian = model.jacobian(values, np.full(6, 1e-3), np.arange(6))
    assert np.isfinite(jacobian).all()
    assert abs(jacobian[:, 0]).max() > 0.0


def test_measurements_may_lie_anywhere_between_inputs() -> None:
    plant = PlantParameters(0.07, 0.05, 0.02, 0.05, 0.0237)
    odd = np.sort(np.random.default_rng(1).uniform(0.0, 5.9, 300))
    among = np.unique(np.concatenate((AT, odd)))
    _, everywhere = motion(plant, stretches_of(AT, SLOW, among, plant.delay_s, 0.03), 0.0)
    _, some = motion(plant, stretches_of(AT, SLOW, odd, plant.delay_s, 0.03), 0.0)
    chosen = everywhere[np.searchsorted(among, odd)]
    assert some[50:] == pytest.approx(chosen[50:], abs=1e-9)


def test_a_body_that_moves_at_first_comes_to_rest_by_its_friction_alone() -> None:
    plant = PlantParameters(0.1, 0.02, 0.05, 0.06, 0.0)
    still = np.zeros_like(AT)
    position, rate = motion(plant, stretches_of(AT, still, AT, 0.0, 0.0), 1.0)
    coasting = Swing(0.0, 1.0, Transient(-0.5, 0.0, 0.0, 1.0), 0.2)
    stop = coasting.first_stop(1, 5.0)
    assert stop is not None
    assert rate[stop < AT] == pytest.approx(0.0)
    assert position[-1] == pytest.approx(coasting.yaw(stop))


def test_a_body_that_is_pushed_back_as_it_hardly_moves_does_not_stick() -> None:
    plant = PlantParameters(1.0, 0.0, 0.1, 0.2, 0.0)
    at = np.array([0.0, 1.0])
    _, rate = motion(plant, stretches_of(at, np.full(2, -10.0), at, 0.0, 0.0), 1e-15)
    assert rate[-1] == pytest.approx(-9.9)


def test_a_body_without_friction_never_sticks() -> None:
    plant = PlantParameters(0.1, 0.0, 0.0, 0.0, 0.0)
    given = np.where(AT < 1.0, 0.1, 0.0)
    _, rate = motion(plant, stretches_of(AT, given, AT, 0.0, 0.0), 0.0)
    assert rate[-1] == pytest.approx(1.0)


@pytest.mark.slow
def test_a_body_that_barely_breaks_away_takes_few_events(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its drive is above static friction as it comes to rest, and below Coulomb's soon after."""
    events = 0
    within = Body._slide_within

    def counted(body: Body, state: State) -> None:
        nonlocal events
        events += 1
        assert events < 500
        within(body, state)

    monkeypatch.setattr(Body, "_slide_within", counted)
    random = np.random.default_rng(5)
    for _ in range(60):
        coulomb, ratio = random.uniform(0.01, 0.1), float(random.choice([1.0, 1.001, 1.3]))
        inertia, damping = float(np.exp(random.uniform(-4, -1))), random.uniform(0.0, 0.3)
        delay_s, given = random.uniform(0.0, 0.1), np.repeat(random.uniform(-0.15, 0.15, 60), 10)
        plant = PlantParameters(inertia, damping, coulomb, coulomb * ratio, delay_s)
        events = 0
        position, rate = motion(plant, stretches_of(AT, given, AT, delay_s, 0.03), 0.0)
        expected = pushed_body(plant, 0.03, AT, given)
        assert position == pytest.approx(expected[0], abs=2e-5)
        assert rate == pytest.approx(expected[1], abs=2e-5)
