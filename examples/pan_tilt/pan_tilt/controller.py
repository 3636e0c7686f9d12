"""The controller: once it sees, it searches until there is a light, then follows it.

It knows neither chips nor clocks; the same object runs in simulation and on the robot.
"""

from firmware_drivers.analog_inputs import Voltages

from firmware_runtime.board.robot import Ending
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import NEVER, seconds
from firmware_runtime.models.motion import Applied
from firmware_runtime.models.pid import Pid, PidGains
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, State
from pan_tilt.follow_check import FollowCheck
from pan_tilt.head import Head
from pan_tilt.settings import ControllerTable, PanTiltSettings
from pan_tilt.sight import Sight

MODE = (
    State("Blind", NEVER, Arrow("seen?1", "Found"), Arrow("seen?0", "Dark")),
    State("Dark", 0, Arrow("follow!0", "Searching")),
    State("Searching", NEVER, Arrow("seen?1", "Found")),
    State("Found", 0, Arrow("follow!1", "Following")),
    State("Following", NEVER, Arrow("seen?0", "Doubting")),
    State("Doubting", "lost", Arrow("seen?1", "Following"), Arrow("follow!0", "Searching")),
)


class Mode(StateDiagram):
    """Follows from the first light until it was dark for `lost` ns, and searches in the dark.

    X: seen, 1 or 0. Y: follow, 1 from now on, 0 no more; neither before anything was seen.
    """

    def __init__(self, name: str, lost: int) -> None:
        super().__init__(name)
        self.seen = self.in_port("seen", int)
        self.follow_out = self.out_port("follow", int)
        self.follow(MODE, lost=lost)


class Controller(Coupled):
    """voltages -> sight -> pan and tilt PIDs -> head -> angles; mode says when to follow.

    What the servos apply comes back: applied -> head -> PIDs. A check for each axis says where the
    head comes no nearer to the light, and ends the run where that goes on.
    """

    def __init__(self, name: str, settings: PanTiltSettings) -> None:
        super().__init__(name)
        self.voltages = self.in_port("voltages", Voltages)
        self.applied = self.in_port("applied", Applied)
        self.pan_angle = self.out_port("pan", float)
        self.tilt_angle = self.out_port("tilt", float)
        self.ended = self.out_port("ended", Ending)
        control, servos = settings.controller, settings.servos
        limits = (
            (servos.pan.least_rad, servos.pan.most_rad),
            (servos.tilt.least_rad, servos.tilt.most_rad),
        )
        self.sight = self.add(Sight("sight", settings.eyes.dark_v))
        self.mode = self.add(Mode("mode", seconds(control.lost_s)))
        self.pan = self.add(Pid("pan", gains(control), reference=0.0))
        self.tilt = self.add(Pid("tilt", gains(control), reference=0.0))
        self.head = self.add(Head("head", limits, control.sweep_rad_s))
        self.pan_check = self.add(FollowCheck("pan_check"))
        self.tilt_check = self.add(FollowCheck("tilt_check"))

        self.couple(self.voltages, self.sight.voltages)
        self.couple(self.sight.seen, self.mode.seen)
        self.couple(self.mode.follow_out, self.head.follow)
        self.couple(self.sight.aside, self.pan.measurement)
        self.couple(self.sight.above, self.tilt.measurement)
        self.couple(self.pan.command, self.head.pan_rate)
        self.couple(self.tilt.command, self.head.tilt_rate)
        self.couple(self.applied, self.head.applied_in)
        self.couple(self.head.pan_effect, self.pan.applied_in)
        self.couple(self.head.tilt_effect, self.tilt.applied_in)
        for check in (self.pan_check, self.tilt_check):
            self.couple(self.mode.follow_out, check.follow)
            self.couple(check.ended, self.ended)
        self.couple(self.sight.aside, self.pan_check.difference)
        self.couple(self.sight.above, self.tilt_check.difference)
        self.couple(self.head.pan_effect, self.pan_check.effect)
        self.couple(self.head.tilt_effect, self.tilt_check.effect)
        self.couple(self.head.pan, self.pan_angle)
        self.couple(self.head.tilt, self.tilt_angle)

    def retune(self, settings: PanTiltSettings) -> None:
        """Take up new gains; the integrals stay, so nothing jumps."""
        self.pan.gains = self.tilt.gains = gains(settings.controller)


def gains(settings: ControllerTable) -> PidGains:
    """The PIDs' gains; their command is a rate in rad/s here."""
    return PidGains(settings.kp, settings.ki, settings.kd, limit=settings.most_rad_s)
