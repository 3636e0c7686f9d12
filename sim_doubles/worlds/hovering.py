"""TachoBot lifted by its central propeller: x, y and yaw move without friction.

Yaw has a closed form. The forces turn with it, so velocity and position are integrated over steps
by Gauss-Legendre quadrature, exact for polynomials of degree nine; a step spans at most about a
quarter radian and, while the motors settle, about one motor lag.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from sim_doubles.worlds.propellers import PropellerPairs
from sim_doubles.worlds.swing import Swing
from sim_doubles.worlds.tachobot_body import TachobotParameters, TachobotState
from sim_doubles.worlds.transient import Transient

__all__ = ["Hovering"]

_STEP_RAD = 0.25
_PAIRS = 4


def _gauss_legendre() -> tuple[tuple[float, float], ...]:
    """The five nodes in 0..1 and their weights."""
    near, far = (math.sqrt(5.0 + sign * 2.0 * math.sqrt(10.0 / 7.0)) / 3.0 for sign in (-1, 1))
    near_weight, far_weight = ((322.0 + sign * 13.0 * math.sqrt(70.0)) / 900.0 for sign in (1, -1))
    symmetric = (
        (-far, far_weight),
        (-near, near_weight),
        (0.0, 128.0 / 225.0),
        (near, near_weight),
        (far, far_weight),
    )
    return tuple((0.5 * (1.0 + node), 0.5 * weight) for node, weight in symmetric)


_NODES = _gauss_legendre()


class Hovering:
    """TachoBot free in the plane, at rest in the origin at first."""

    def __init__(self, parameters: TachobotParameters) -> None:
        self._mass = parameters.mass_kg
        self._leverage = parameters.lever_arm_m / parameters.yaw_inertia_kg_m2
        self._spin_up = math.sqrt(_PAIRS * parameters.pair_thrust_n * self._leverage)
        self.state = TachobotState(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)

    @property
    def turn(self) -> tuple[float, float]:
        """Yaw and its rate."""
        return self.state.yaw_rad, self.state.yaw_rate_rad_s

    def acceleration(self, driven: Callable[[], PropellerPairs]) -> tuple[float, float]:
        """Forward and left, in m/s2, now."""
        now = driven()
        return (now.forward().now() / self._mass, now.left().now() / self._mass)

    def advance(self, propellers: PropellerPairs, elapsed_s: float) -> None:
        """Move for `elapsed_s` as these push."""
        yaw, rate = self.state.yaw_rad, self.state.yaw_rate_rad_s
        path = _Path(
            propellers.forward() * (1.0 / self._mass),
            propellers.left() * (1.0 / self._mass),
            Swing(yaw, rate, propellers.turning(self._leverage), 0.0),
        )
        propellers.advance(elapsed_s)
        begin = 0.0
        while begin < elapsed_s:
            turning = abs(path.swing.rate(begin)) + self._spin_up
            settling = 1.0 / path.forward.decay + 0.25 * begin
            step = min(elapsed_s - begin, settling, _STEP_RAD / turning)
            self.state = path.follow(self.state, begin, step)
            begin += step


class _Path(NamedTuple):
    """Motion of the body while its duties hold: accelerations in its own axes, and its turning."""

    forward: Transient
    left: Transient
    swing: Swing

    def follow(self, state: TachobotState, begin: float, step: float) -> TachobotState:
        """The state `step` seconds after `state`, which held `begin` seconds from the start."""
        vx_gain = vy_gain = x_gain = y_gain = 0.0
        for node, weight in _NODES:
            ax, ay = self._acceleration(begin + node * step)
            vx_gain += weight * ax
            vy_gain += weight * ay
            x_gain += weight * (1.0 - node) * ax
            y_gain += weight * (1.0 - node) * ay
        return TachobotState(
            state.x_m + step * (state.vx_m_s + step * x_gain),
            state.vx_m_s + step * vx_gain,
            state.y_m + step * (state.vy_m_s + step * y_gain),
            state.vy_m_s + step * vy_gain,
            *self.swing.state(begin + step),
        )

    def _acceleration(self, t: float) -> tuple[float, float]:
        """Equation (1): the body's acceleration turned into the axes of the room."""
        yaw, forward, left = self.swing.yaw(t), self.forward.at(t), self.left.at(t)
        cosine, sine = math.cos(yaw), math.sin(yaw)
        return (cosine * forward - sine * left, sine * forward + cosine * left)
