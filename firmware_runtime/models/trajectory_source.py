"""Runs along a path, and stops and comes back as the position behind it goes and comes."""

import math

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.motion import Applied, Motion, Path, PoseSetpoint, Setpoint, at_rest
from firmware_runtime.models.position_fix import PositionState
from firmware_runtime.models.trajectory_paths import Rejoin, RejoinLimits, rejoin


class TrajectorySource(Atomic):
    """Sends the setpoints of x, y and yaw every period, as long as there is a position.

    waiting (period) --state? TRACKING--> following (period) --x!, y!, yaw!--> following
    following --state? LOST, applied? NOTHING--> braking (period) --x!, y!, yaw!--> braking
    braking --state? TRACKING, applied? PART, ALL--> following
    following, braking --enable? false--> waiting
    any --state? SAFE--> given up (period)

    `enabled` is how it begins; while it is not, nothing is sent. The first setpoint is the body's
    own motion, and from there it goes to the path, as it does after it braked. Braking, the
    setpoint of x and y is wherever the body is taken to be, at rest, so that speed alone is
    controlled, and yaw stays; the path waits, and so it does while actuators apply nothing. A
    period that the executive skips holds the path up for as long.
    """

    def __init__(
        self, name: str, path: Path, period: int, limits: RejoinLimits, *, enabled: bool = True
    ) -> None:
        super().__init__(name)
        self.enable = self.in_port("enable", bool)
        self.state_in = self.in_port("state", PositionState)
        self.applied_in = self.in_port("applied", Applied)
        self.x_now = self.in_port("x_now", Motion)
        self.y_now = self.in_port("y_now", Motion)
        self.yaw_now = self.in_port("yaw_now", Motion)
        self.x = self.out_port("x", Setpoint)
        self.y = self.out_port("y", Setpoint)
        self.yaw = self.out_port("yaw", Setpoint)
        self.way = path
        self.period = period
        self.limits = limits
        self.enabled = enabled
        self.state = PositionState.NO_POSITION
        self.applied = Applied.ALL
        self.setpoint: PoseSetpoint | None = None
        """What is sent at the end of this period."""
        self.goal: PoseSetpoint | None = None
        """Where the path is then, or where it waits; the setpoint may be on its way there."""
        self._rejoin: Rejoin | None = None
        self._since_rejoin = 0
        """Ns; it stands still while the body brakes."""
        self._turns_rad = 0.0
        """Whole turns by which the body's yaw is ahead of the path's."""
        self._motions = [Motion(0.0, 0.0)] * 3

    def initialize(self) -> None:
        """Wait for a position, awake every period."""
        self.hold_in("waiting", self.period)

    def output(self) -> None:
        """Send the setpoint, if there is one."""
        if self.setpoint is not None:
            self.x.send(self.setpoint.x)
            self.y.send(self.setpoint.y)
            self.yaw.send(self.setpoint.yaw)

    def internal(self) -> None:
        """Go on for a period."""
        if self.phase == "following":
            self._since_rejoin += self.sigma
        self.hold_in(self.phase, self.period)
        if self.phase == "following":
            self.setpoint = self._following(self.sigma)

    def external(self, elapsed: int) -> None:
        """Take the newest motion in; begin, brake or give up by the state."""
        if self.phase == "following":
            self._since_rejoin += elapsed
        self.continue_(elapsed)
        for n, port in enumerate((self.x_now, self.y_now, self.yaw_now)):
            if port:
                self._motions[n] = port[-1]
        if self.enable:
            self.enabled = self.enable[-1]
        if self.state_in:
            self.state = self.state_in[-1]
        if self.applied_in:
            self.applied = self.applied_in[-1]
        if self.phase != "given up" and (self.state_in or self.enable or self.applied_in):
            self._obey()
        if self.phase == "braking":
            self._brake()

    # ---------------------------------------------------------------------------------------------

    def _obey(self) -> None:
        if self.state is PositionState.SAFE:
            self.phase, self.setpoint = "given up", None
        elif not self.enabled:
            self.phase, self.setpoint = "waiting", None
        elif self.state is PositionState.LOST and self.phase == "following":
            self.phase = "braking"
        elif self.state is PositionState.TRACKING and self.phase != "following":
            self._begin()
        if self.phase == "following" and self.applied is Applied.NOTHING:
            self.phase = "braking"  # commands still leave: an actuator begins with the first

    def _begin(self) -> None:
        """Go to the path from where the body is."""
        self.phase = "following"
        along_s = 0.0 if self._rejoin is None else self._along().position
        path = self.way.at(along_s)
        ahead = (self._motions[2].position - path.yaw.position) / math.tau
        self._turns_rad = round(ahead) * math.tau
        goals = (path.x.position, path.y.position, path.yaw.position + self._turns_rad)
        offsets = [
            (motion.position - goal, motion.rate)
            for motion, goal in zip(self._motions, goals, strict=True)
        ]
        self._rejoin = rejoin(offsets, self.limits, along_s)
        self._since_rejoin = 0
        self.setpoint = self._following(self.sigma)

    def _brake(self) -> None:
        """Ask for rest wherever the body is taken to be, and for the yaw that was asked for."""
        if self.setpoint is not None:
            x, y, _ = self._motions
            yaw = self.setpoint.yaw.position
            self.setpoint = PoseSetpoint(at_rest(x.position), at_rest(y.position), at_rest(yaw))

    def _along(self, ahead: int = 0) -> Setpoint:
        """The path's own time `ahead` ns from now, its pace, and that one's rate."""
        assert self._rejoin is not None  # noqa: S101 -- asked for after it began only
        return self._rejoin.along((self._since_rejoin + ahead) / SECOND)

    def _following(self, ahead: int) -> PoseSetpoint:
        assert self._rejoin is not None  # noqa: S101
        along = self._along(ahead)
        x, y, yaw = (_paced(each, along) for each in self.way.at(along.position))
        turned = yaw._replace(position=yaw.position + self._turns_rad)
        at_s = (self._since_rejoin + ahead) / SECOND
        self.goal = PoseSetpoint(x, y, turned)
        return self._rejoin.added_to(self.goal, at_s)


def _paced(setpoint: Setpoint, along: Setpoint) -> Setpoint:
    """The setpoint of a path whose own time runs at a pace."""
    _, pace, change = along
    position, rate, acceleration = setpoint
    return Setpoint(position, rate * pace, acceleration * pace * pace + rate * change)
