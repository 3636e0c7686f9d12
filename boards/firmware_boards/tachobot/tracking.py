"""TachoBot's controller in mode `track`: it knows where it is, and follows a path.

The errors of x and y are those of the room; `allocation` turns their commands into the body's axes
by the yaw of the room. The estimator works from the first sample on, so that there is a position
before outputs are armed; the trajectory begins once the robot is lifted. Without a position no
command leaves, and the propellers stay off.
"""

from collections.abc import Callable
from typing import Final

from firmware_drivers.chips.mpu9250_burst import InertialSample
from firmware_drivers.thrust_pairs import Forces

from firmware_boards.tachobot.allocation import Allocation
from firmware_boards.tachobot.attitude import Attitude, gap_of, heading_check
from firmware_boards.tachobot.course import path_of
from firmware_boards.tachobot.pid_controller import PidController
from firmware_boards.tachobot.settings import PidSettings, TachobotSettings, TrackSettings
from firmware_runtime.board.robot import Ending
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import NEVER, SECOND, seconds
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.pid import TrackingPid
from firmware_runtime.models.position_estimator import PositionEstimator
from firmware_runtime.models.position_fix import (
    PlanarInertial,
    PoseFix,
    PositionFix,
    PositionState,
)
from firmware_runtime.models.position_watch import PositionWatch
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, Kept, State, always
from firmware_runtime.models.trajectory_source import TrajectorySource

AGAIN_WITHIN: Final = 10 * SECOND
"""Ns within which a position that was lost is not to be lost again."""
PERIODS: Final = 10
"""Periods of control that a command of x or y lasts, and of setpoints that one counts."""


class TrackingController(PidController[TrackingPid]):
    """sample, position -> estimator -> PIDs along the trajectory -> allocation -> forces."""

    def __init__(self, name: str, settings: TachobotSettings, control: TrackSettings) -> None:
        super().__init__(name, settings.pair_thrust_n)
        self.sample = self.in_port("sample", InertialSample)
        self.enable = self.in_port("enable", bool)
        self.position = self.in_port("position", PositionFix)
        self.pose = self.in_port("pose", PoseFix)
        self.forces = self.out_port("forces", Forces)
        compass = seconds(control.compass_time_constant_s)
        estimates = settings.position.estimator(control.period_s)
        period, limits = seconds(settings.trajectory.period_s), settings.trajectory.rejoin()

        self.attitude = self.add(Attitude("attitude", compass, enabled=True, gap=gap_of(control)))
        inertial = self.add(Inertial("inertial"))
        self.estimator = self.add(PositionEstimator("estimator", estimates))
        self.watch = self.add(PositionWatch("watch", settings.position.patience()))
        self.given_up = self.add(GivenUp("given_up", settings.position.safe_after_s))
        self.trajectory = self.add(
            TrajectorySource("trajectory", path_of(settings), period, limits, enabled=False)
        )
        mass_kg, turning = settings.mass_kg, settings.turning_inertia
        self._pids = {
            "x": self._pid("x", control.x, mass_kg, PERIODS * period),
            "y": self._pid("y", control.y, mass_kg, PERIODS * period),
            "yaw": self._pid("yaw", control.yaw, turning, PERIODS * period),
        }
        timeout = PERIODS * seconds(control.period_s)
        self.allocation = self.add(Allocation("allocation", settings.pair_thrust_n, timeout))

        if control.compass_time_constant_s:
            check = self.add(heading_check(control))
            self.couple(self.sample, check.rate)
            self.couple(self.sample, check.value)
            self.couple(check.agrees_out, self.attitude.trusted)
        self.couple(self.attitude.ended, self.given_up.no_yaw)
        self.couple(self.sample, inertial.sample)
        self.couple(self.sample, self.attitude.sample)
        self.couple(self.enable, self.trajectory.enable)
        self.couple(self.attitude.yaw, inertial.yaw)
        self.couple(inertial.inertial, self.estimator.inertial)
        self.couple(self.position, self.estimator.position)
        self.couple(self.pose, self.estimator.pose)
        self.couple(self.estimator.fix, self.watch.fix)
        self.couple(self.watch.state, self.estimator.state_in)
        self.couple(self.watch.state, self.trajectory.state_in)
        self.couple(self.watch.state, self.given_up.state)
        self.couple(self.applied, self.trajectory.applied_in)
        self._couple_axes(control)
        self._couple_applied(self.allocation)
        self.couple(self.allocation.forces_out, self.forces)

    def _couple_axes(self, control: TrackSettings) -> None:
        """Estimate and setpoint to each PID, and their commands to the allocation."""
        estimator, trajectory, allocation = self.estimator, self.trajectory, self.allocation
        x, y, yaw = self._pids.values()
        self.couple(estimator.x, trajectory.x_now)
        self.couple(estimator.y, trajectory.y_now)
        self.couple(estimator.yaw, trajectory.yaw_now)
        self.couple(trajectory.x, x.setpoint)
        self.couple(trajectory.y, y.setpoint)
        self.couple(trajectory.yaw, yaw.setpoint)
        self.couple(estimator.x, x.measurement)
        self.couple(estimator.y, y.measurement)
        self.couple(estimator.yaw, yaw.measurement)
        self.couple(estimator.yaw, allocation.yaw)
        self.couple(x.command, allocation.x_n)
        self.couple(y.command, allocation.y_n)
        delayed = self._delayed(yaw.command, control.yaw.delay_s)
        contradiction = self._couple_yaw(delayed, estimator.yaw, allocation, control.movement_check)
        self.couple(contradiction, self.attitude.contradiction)
        self.couple(self.unsteered, self.attitude.contradiction)

    def _pid(self, name: str, settings: PidSettings, inertia: float, timeout: int) -> TrackingPid:
        return self.add(TrackingPid(name, self._gains(settings), inertia, timeout))


class Inertial(Atomic):
    """Answers every yaw with the acceleration of the sample that it was made of.

    waiting --sample?--> waiting --yaw?--> sending (0) --inertial!--> waiting
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.sample = self.in_port("sample", InertialSample)
        self.yaw = self.in_port("yaw", Motion)
        self.inertial = self.out_port("inertial", PlanarInertial)
        self._level = (0.0, 0.0)
        self._motion = Motion(0.0, 0.0)

    def output(self) -> None:
        """Send both."""
        self.inertial.send(PlanarInertial(*self._level, *self._motion))

    def internal(self) -> None:
        """Wait for the next sample."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Keep the sample; its yaw is answered."""
        if self.sample:
            self._level = self.sample[-1].acceleration[:2]
        if self.yaw:
            self._motion = self.yaw[-1]
            self.activate("sending")
        else:
            self.continue_(elapsed)


class GivenUp(StateDiagram):
    """Says once that the run has failed: without a position, or with one that is lost again.

    A position that comes and is not believed is lost, begun with anew, and lost again: the inertial
    unit contradicts it, and the robot flies by that in between.

    watching --state? LOST--> lost once (AGAIN_WITHIN) --> watching
    lost once --state? LOST--> lost twice (0) --ended!--> over
    watching, lost once --state? SAFE--> without (0) --ended!--> over
    watching, lost once --no_yaw?--> without yaw (0) --ended!--> over
    """

    def __init__(self, name: str, safe_after_s: float) -> None:
        super().__init__(name)
        self.state = self.in_port("state", PositionState)
        self.no_yaw = self.in_port("no_yaw", Ending)
        self.ended = self.out_port("ended", Ending)
        none = f"no position for {safe_after_s:g} s"
        twice = f"the position was lost twice within {AGAIN_WITHIN / SECOND:g} s"
        gone = (Arrow("state?safe", "without"), Arrow("no_yaw?why", "without yaw"))
        self.follow(
            (
                State("watching", NEVER, *gone, Arrow("state?lost", "lost once")),
                State(
                    "lost once",
                    AGAIN_WITHIN,
                    *gone,
                    Arrow("state?lost", "lost twice"),
                    Arrow("", "watching"),
                ),
                State("without", 0, Arrow("ended!none", "over")),
                State("without yaw", 0, Arrow("ended!why", "over")),
                State("lost twice", 0, Arrow("ended!twice", "over")),
                State("over", NEVER),
            ),
            {
                "safe": _is(PositionState.SAFE),
                "lost": _is(PositionState.LOST),
                "none": always(Ending(none, failed=True)),
                "twice": always(Ending(twice, failed=True)),
                "why": Ending,
            },
        )


def _is(wanted: PositionState) -> Callable[[PositionState, Kept], bool]:
    return lambda state, _kept: state is wanted
