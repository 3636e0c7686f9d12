"""The controller: it follows the wall at a distance while it sees one.

It knows neither chips nor clocks; the same object runs in simulation and on the robot.
"""

import math

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import SECOND, seconds
from firmware_runtime.models.applied import Applied
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.pid import Pid, PidGains
from firmware_runtime.models.state_diagram import StateDiagram
from firmware_runtime.models.state_table import Arrow, State

from robotname.settings import ControllerTable

MODE = (
    State("Waking", 0, Arrow("sonar!1", "Waiting")),
    State("Waiting", "lost", Arrow("wall?1", "Found"), Arrow("sonar!1", "Waiting")),
    State("Found", 0, Arrow("follow!1", "Following")),
    State("Following", "lost", Arrow("wall?1", "Following"), Arrow("follow!0", "Waiting")),
)


class Mode(StateDiagram):
    """Wakes the sonar; follows from the first echo until there was none for `lost` ns.

    It wakes it again after as long without an echo: the sonar may be in another process, which
    began later or again.

    X: wall, 1 with every echo. Y: sonar, 1 starts it; follow, 1 from now on, 0 no more.
    """

    def __init__(self, name: str, lost: int) -> None:
        super().__init__(name)
        self.wall = self.in_port("wall", int)
        self.sonar = self.out_port("sonar", int)
        self.follow_out = self.out_port("follow", int)
        self.follow(MODE, lost=lost)


class Tracker(Atomic):
    """Answers every distance with the motion of the wall; +inf, no echo, begins again.

    waiting --distance?--> sending (0) --motion!--> waiting
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.distance = self.in_port("distance", float, takes="infinities")
        self.motion_out = self.out_port("motion", Motion)
        self.motion: Motion | None = None
        self._since = 0

    def output(self) -> None:
        """Send where the wall is, in m, and how fast that changes, in m/s."""
        if self.motion is not None:
            self.motion_out.send(self.motion)

    def internal(self) -> None:
        """Wait for the next distance."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take the distance, and the rate from the one before."""
        self._since += elapsed
        distance = self.distance[-1]
        if math.isinf(distance):
            self.motion = None
            self.continue_(elapsed)
            return
        before, since_s = self.motion, self._since / SECOND
        rate = 0.0 if before is None or not since_s else (distance - before.position) / since_s
        self.motion = Motion(distance, rate)
        self._since = 0
        self.activate("sending")


class Helm(Atomic):
    """Lets the PID drive the motor while the robot follows, and stops it when it no longer does.

    waiting, following --command?--> steering (0) --drive!--> waiting
    waiting --follow? 0--> steering (0) --drive! 0--> waiting
    waiting --applied?, follow?--> steering (0) --effect!--> waiting

    `effect` is what becomes of the PID's commands, for its integral: what the motor applies, or
    nothing where they are not passed on.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.follow = self.in_port("follow", int)
        self.command = self.in_port("command", float)
        self.applied_in = self.in_port("applied", Applied)
        self.drive_out = self.out_port("drive", float)
        self.effect_out = self.out_port("effect", Applied)
        self.is_following = False
        self.drive: float | None = None
        self.by_motor = Applied.NOTHING
        self.effect: Applied | None = None

    def output(self) -> None:
        """Send the drive, as a share of full voltage; forward is towards the wall."""
        if self.drive is not None:
            self.drive_out.send(self.drive)
        if self.effect is not None:
            self.effect_out.send(self.effect)

    def internal(self) -> None:
        """Wait for the next command."""
        self.drive = self.effect = None
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take the newest command: more distance is a drive backward."""
        if self.follow:
            self.is_following = self.follow[-1] == 1
        if self.is_following and self.command:
            self.drive = -self.command[-1]
        elif self.follow and not self.is_following:
            self.drive = 0.0
        if self.applied_in:
            self.by_motor = self.applied_in[-1]
        if self.applied_in or self.follow:
            self.effect = self.by_motor if self.is_following else Applied.NOTHING
        if self.drive is None and self.effect is None:
            self.continue_(elapsed)
        else:
            self.activate("steering")


class Controller(Coupled):
    """distance -> tracker -> pid -> helm -> drive, while mode sees the wall.

    What the motor applies of it comes back: applied -> helm -> pid.
    """

    def __init__(self, name: str, settings: ControllerTable) -> None:
        super().__init__(name)
        self.distance = self.in_port("distance", float)
        self.wall = self.in_port("wall", int)
        self.reference = self.in_port("reference", float)
        self.applied = self.in_port("applied", Applied)
        self.sonar = self.out_port("sonar", int)
        self.drive = self.out_port("drive", float)
        self.mode = self.add(Mode("mode", seconds(settings.lost_s)))
        self.tracker = self.add(Tracker("tracker"))
        self.pid = self.add(Pid("pid", gains(settings), settings.distance_m))
        self.helm = self.add(Helm("helm"))

        self.couple(self.mode.sonar, self.sonar)
        self.couple(self.wall, self.mode.wall)
        self.couple(self.mode.follow_out, self.helm.follow)
        self.couple(self.distance, self.tracker.distance)
        self.couple(self.tracker.motion_out, self.pid.measurement)
        self.couple(self.reference, self.pid.reference_in)
        self.couple(self.pid.command, self.helm.command)
        self.couple(self.helm.drive_out, self.drive)
        self.couple(self.applied, self.helm.applied_in)
        self.couple(self.helm.effect_out, self.pid.applied_in)

    def retune(self, settings: ControllerTable) -> None:
        """Take up new gains; the integral stays, so nothing jumps."""
        self.pid.gains = gains(settings)


def gains(settings: ControllerTable) -> PidGains:
    """The PID's gains; its command is a share of full voltage here."""
    return PidGains(settings.kp, settings.ki, settings.kd, limit=settings.max_drive)
