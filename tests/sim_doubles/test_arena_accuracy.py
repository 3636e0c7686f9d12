"""The vehicle's path against a tight numerical solution of its differential equation."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from firmware_runtime.devs.time import SECOND
from sim_doubles.worlds.arena import ArenaParameters
from tests.support.arena_rig import ArenaRig

Vector = NDArray[np.float64]

FAR = ArenaParameters(target=(500.0, 500.0), right_slip=0.02, left_slip=0.05)
LEFT_M, RIGHT_M = 0.05 * 0.95, 0.05 * 0.98


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_minute_of_random_ramps_stays_on_a_tight_solution(seed: int) -> None:
    choice = np.random.default_rng(seed)
    rig, at, worst = ArenaRig(FAR), 0, 0.0
    reference = np.array(rig.arena.pose(0))
    while at < 60 * SECOND:
        until = at + int(choice.integers(3_000_001, 1_500_000_001))
        reference = solved(rig, reference, at, until)
        at = until
        worst = max(worst, float(np.abs(reference - rig.arena.pose(at)).max()))
        right, left, step = (int(n) for n in choice.integers((-127, -127, 0), (128, 128, 11)))
        rig.drive(at, right, left, step)
    assert worst < 1e-10
    assert np.abs(reference[:2]).max() > 0.5  # it went somewhere


def solved(rig: ArenaRig, pose: Vector, since: int, until: int) -> Vector:
    """The pose at `until`, integrated over each stretch of even speeds."""
    for stretch in rig.motors.stretches(since, until):
        right, left = stretch.speeds_rad_s
        solution = solve_ivp(
            derivative(right * RIGHT_M, left * LEFT_M),
            (0.0, (stretch.until - stretch.since) / SECOND),
            pose,
            method="DOP853",
            rtol=1e-12,
            atol=1e-13,
        )
        pose = solution.y[:, -1]
    return pose


def derivative(right_m_s: float, left_m_s: float) -> Callable[[float, Vector], Vector]:
    """How the pose changes with these speeds of the treads."""
    speed, rate = 0.5 * (right_m_s + left_m_s), (right_m_s - left_m_s) / 0.25
    return lambda _t, z: np.array([speed * np.cos(z[2]), speed * np.sin(z[2]), rate])
