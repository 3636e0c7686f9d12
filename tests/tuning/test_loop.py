"""Margins beside what is known of loops, and beside loops that run."""

import math
from dataclasses import replace

import pytest

from firmware_runtime.lab.identification.plant import PlantParameters
from firmware_runtime.lab.tuning.loop import Gains, Loop, Predictor, margins
from firmware_runtime.lab.tuning.response import Body, Scenario, stepped
from firmware_runtime.models.plant import SecondOrderPlant

GAINS = Gains(0.75, 0.0, 0.55)


def swing(factor: float, delay_s: float) -> float:
    """How much larger the late swings of a loop are than its early ones, gains times a factor."""
    plant = PlantParameters(0.075, 0.0, 0.0, 0.0, delay_s)
    body = Body(plant, 0.03, 0.4, 1e9, 0.01)
    gains = Gains(factor * GAINS.kp, 0.0, factor * GAINS.kd)
    positions = stepped(body, gains, Scenario(1.0, 40.0, [0.0] * 4000)).positions
    early, late = positions[500:1500], positions[3000:]
    return (max(late) - min(late)) / (max(early) - min(early))


def test_a_pure_integral_of_a_rate_has_the_margins_of_the_textbook() -> None:
    """gain / s behind a delay: crossover at the gain, phase margin 90 degrees less gain * delay."""
    stiff = SecondOrderPlant(gain=2000.0, damping_per_s=1000.0)
    found = margins(Loop(stiff, delay_s=0.2, period_s=1e-4), Gains(1.0, 0.0, 0.0))
    assert found.crossover_rad_s == pytest.approx(2.0, rel=1e-3)
    assert found.phase_deg == pytest.approx(90.0 - math.degrees(2.0 * 0.2), abs=0.5)
    assert found.gain_db == pytest.approx(20.0 * math.log10(math.pi / 0.4 / 2.0), abs=0.1)
    assert found.delay_s == pytest.approx(math.radians(found.phase_deg) / 2.0, rel=1e-2)


@pytest.mark.slow
def test_a_loop_grows_just_beyond_its_gain_margin_and_fades_just_within() -> None:
    loop = Loop(SecondOrderPlant(0.4 / 0.075, 0.0, 0.03), 0.083, 0.01)
    factor = 10.0 ** (margins(loop, GAINS).gain_db / 20.0)
    assert swing(1.03 * factor, 0.083) > 1.0
    assert swing(0.97 * factor, 0.083) < 1.0


@pytest.mark.slow
def test_a_loop_grows_just_beyond_its_delay_margin_and_fades_just_within() -> None:
    loop = Loop(SecondOrderPlant(0.4 / 0.075, 0.0, 0.03), 0.02, 0.01)
    margin_s = margins(loop, GAINS).delay_s
    assert swing(1.0, 0.02 + 1.03 * margin_s) > 1.0
    assert swing(1.0, 0.02 + 0.97 * margin_s) < 1.0


@pytest.mark.parametrize("delay_s", [0.35, 0.5, 1.5, 2.0])
def test_an_unstable_loop_has_no_margin_left_however_far_its_phase_has_turned(
    delay_s: float,
) -> None:
    found = margins(Loop(SecondOrderPlant(0.4 / 0.075, 0.0, 0.03), delay_s, 0.01), GAINS)
    assert not found.is_stable
    assert (found.gain_db < 0.0, found.phase_deg < 0.0, found.delay_s) == (True, True, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("ki_of_kp", [0.0, 0.3])
@pytest.mark.parametrize("kd", [0.07, 0.2, 0.55, 1.5])
@pytest.mark.parametrize("delay_s", [0.0, 0.1, 0.4, 0.8])
def test_a_loop_is_stable_where_its_step_comes_to_an_end(
    delay_s: float, kd: float, ki_of_kp: float
) -> None:
    gains = Gains(0.75, 0.75 * ki_of_kp, kd)
    found = margins(Loop(SecondOrderPlant(0.4 / 0.075, 0.0, 0.03), delay_s, 0.01), gains)
    body = Body(PlantParameters(0.075, 0.0, 0.0, 0.0, delay_s), 0.03, 0.4, 1e12, 0.01)
    positions = stepped(body, gains, Scenario(1.0, 60.0, [0.0] * 6000)).positions
    assert found.is_stable == (max(abs(each - 1.0) for each in positions[4500:]) < 0.5)


def test_a_predictor_of_no_delay_changes_no_margin() -> None:
    plant = SecondOrderPlant(5.3, 0.2, 0.03)
    loop = Loop(plant, 0.08, 0.01)
    plain, predicted = margins(loop, GAINS), margins(loop, GAINS, Predictor(plant, 0.0))
    assert predicted.gain_db == pytest.approx(plain.gain_db)
    assert predicted.phase_deg == pytest.approx(plain.phase_deg)


@pytest.mark.parametrize("lag_s", [0.0, 0.03])
def test_a_predictor_gives_back_margin_that_a_delay_takes(lag_s: float) -> None:
    plant = SecondOrderPlant(5.3, 0.0, lag_s)
    loop, gains = Loop(plant, 0.08, 0.01), Gains(6.0, 0.01, 1.6)
    without, with_it = margins(loop, gains), margins(loop, gains, Predictor(plant, 0.08))
    assert with_it.phase_deg > without.phase_deg + 15.0
    assert with_it.gain_db > without.gain_db + 3.0
    none = margins(replace(loop, delay_s=0.0), gains)
    assert with_it.phase_deg < none.phase_deg
