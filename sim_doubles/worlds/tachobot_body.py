"""Bodies of TachoBot: hovering, and on a turntable.

Lifted by its central propeller, x, y and yaw move without friction. Yaw has a closed form. The
forces turn with it, so velocity and position are integrated over steps by Gauss-Legendre
quadrature, exact for polynomials of degree nine; a step spans at most about a quarter radian and,
while the motors settle, about one motor lag.

On its turntable only yaw moves, and the bearing sticks and slips. A standing bearing holds until
the moment exceeds its static friction. A turning one resists with Coulomb friction against the
motion and with viscous damping; where the rate reaches zero it sticks, or turns back if the moment
exceeds static friction. The instants of both are found inside a step, so the motion does not depend
on the steps.
"""

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

from firmware_boards.tachobot.plant_settings import WorldSettings

from sim_doubles.worlds.propellers import PropellerPairs
from sim_doubles.worlds.swing import Swing, Transient, recurring_course, turned

Mounting = Literal["platform", "free"]
"""On the rotating platform only yaw moves; free, hovering on its central propeller, all three."""


class TachobotState(NamedTuple):
    """Position, yaw and their rates, in the axes of the room: x and y level, yaw from x to y."""

    x_m: float
    vx_m_s: float
    y_m: float
    vy_m_s: float
    yaw_rad: float
    yaw_rate_rad_s: float


class TachobotParameters(WorldSettings, frozen=True):
    """The numbers of the plant, as board.toml has them, and how it is mounted."""

    mounting: Mounting = "platform"


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
        self._is_held = False

    @property
    def turn(self) -> tuple[float, float]:
        """Yaw and its rate."""
        return self.state.yaw_rad, self.state.yaw_rate_rad_s

    def acceleration(self, driven: Callable[[], PropellerPairs]) -> tuple[float, float]:
        """Forward and left, in m/s2, now."""
        if self._is_held:
            return (0.0, 0.0)
        now = driven()
        return (now.forward().now() / self._mass, now.left().now() / self._mass)

    def push(self, rate_rad_s: float) -> None:
        """Change the yaw rate by so much, at once."""
        self.state = self.state._replace(yaw_rate_rad_s=self.state.yaw_rate_rad_s + rate_rad_s)

    def hold(self, *, is_held: bool) -> None:
        """Keep it where it is, at rest, or let go of it."""
        self.state = self.state._replace(vx_m_s=0.0, vy_m_s=0.0, yaw_rate_rad_s=0.0)
        self._is_held = is_held

    def advance(self, propellers: PropellerPairs, elapsed_s: float) -> None:
        """Move for `elapsed_s` as these push."""
        if self._is_held:
            propellers.advance(elapsed_s)
            return
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


class Turntable:
    """TachoBot on the platform, at rest at first; x and y stay zero."""

    def __init__(self, parameters: TachobotParameters) -> None:
        self._leverage = parameters.lever_arm_m / parameters.yaw_inertia_kg_m2
        self._damping = parameters.yaw_damping_nms / parameters.yaw_inertia_kg_m2
        self._static = parameters.static_friction_nm / parameters.yaw_inertia_kg_m2
        self._coulomb = parameters.coulomb_friction_nm / parameters.yaw_inertia_kg_m2
        self.turn = (0.0, 0.0)
        """Yaw and its rate."""
        self._direction = 0  # the sense of rotation; 0 while the bearing sticks
        self._is_held = False

    @property
    def state(self) -> TachobotState:
        """Return its state now."""
        yaw, rate = self.turn
        return TachobotState(0.0, 0.0, 0.0, 0.0, yaw, rate)

    def acceleration(self, _driven: Callable[[], PropellerPairs]) -> tuple[float, float]:
        """Forward and left, in m/s2: the centre is pinned."""
        return (0.0, 0.0)

    def push(self, rate_rad_s: float) -> None:
        """Change the yaw rate by so much, at once; a bearing that stuck slides."""
        yaw, rate = self.turn
        self.turn = (yaw, rate + rate_rad_s)
        if rate + rate_rad_s != 0.0:
            self._direction = 1 if rate + rate_rad_s > 0.0 else -1

    def hold(self, *, is_held: bool) -> None:
        """Keep it where it is, at rest, or let go of it: its bearing sticks."""
        self.turn = (self.turn[0], 0.0)
        self._direction = 0
        self._is_held = is_held

    def advance(self, propellers: PropellerPairs, elapsed_s: float) -> None:
        """Turn for `elapsed_s` as these push."""
        if self._is_held:
            propellers.advance(elapsed_s)
            return
        if self._static == 0.0:
            (yaw, rate), terms = self.turn, propellers.turn_for(self._leverage, elapsed_s)
            course = recurring_course(self._damping, propellers.decay, elapsed_s)
            self.turn = turned(yaw, rate, terms, course)
            return
        drive = propellers.turning(self._leverage)
        propellers.advance(elapsed_s)
        while elapsed_s > 0.0:
            if self._direction == 0:
                spent = self._stick(drive, elapsed_s)
            else:
                spent = self._slide(drive, elapsed_s)
            drive = drive.after(spent)
            elapsed_s -= spent

    def _stick(self, drive: Transient, until: float) -> float:
        """Hold until the drive breaks the bearing away; return the time that took."""
        forth, back = drive.exceeds(self._static), (drive * -1.0).exceeds(self._static)
        if min(forth, back) >= until:
            return until
        self._direction = 1 if forth < back else -1
        return min(forth, back)

    def _slide(self, drive: Transient, until: float) -> float:
        """Turn until the bearing stops; return the time that took."""
        net = drive.less(self._direction * self._coulomb)
        swing = Swing(*self.turn, net, self._damping)
        stop = swing.first_stop(self._direction, until)
        if stop is None:
            self.turn = swing.state(until)
            return until
        self.turn, self._direction = (swing.yaw(stop), 0.0), 0
        return stop
