"""The rotating platform TachoBot stands on: only yaw moves, and the bearing sticks and slips.

A standing bearing holds until the moment exceeds its static friction. A turning one resists with
Coulomb friction against the motion and with viscous damping; where the rate reaches zero it sticks,
or turns back if the moment exceeds static friction. The instants of both are found inside a step,
so the motion does not depend on the steps.
"""

from collections.abc import Callable

from sim_doubles.worlds.propellers import PropellerPairs
from sim_doubles.worlds.swing import Swing, recurring_course, turned
from sim_doubles.worlds.tachobot_body import TachobotParameters, TachobotState
from sim_doubles.worlds.transient import Transient

__all__ = ["Turntable"]


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

    @property
    def state(self) -> TachobotState:
        """Return its state now."""
        yaw, rate = self.turn
        return TachobotState(0.0, 0.0, 0.0, 0.0, yaw, rate)

    def acceleration(self, _driven: Callable[[], PropellerPairs]) -> tuple[float, float]:
        """Forward and left, in m/s2: the centre is pinned."""
        return (0.0, 0.0)

    def advance(self, propellers: PropellerPairs, elapsed_s: float) -> None:
        """Turn for `elapsed_s` as these push."""
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
