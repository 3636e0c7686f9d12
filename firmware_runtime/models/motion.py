"""Values of a control loop: motions, setpoints, paths, and how much of a command is applied.

A setpoint is a position with its rate and its acceleration: a controller that knows all three need
not wait for an error before it pushes. A path gives the setpoint of a pose for every instant of its
own time; `trajectory_source` runs along it in the time of a model.

A command without effect teaches nothing. An actuator says at its port `applied` whether it applies
what it is commanded to; whatever goes on by what was commanded follows that: integrals, predictors,
estimators that have nothing but the command, references in time. They stand still while nothing is
applied, so that the time a robot spends disarmed changes no later answer. It is said in terms that
need no conversion on the way back: it holds for every unit, sign and axis that the command had.
"""

from collections.abc import Sequence
from enum import IntEnum
from typing import Literal, NamedTuple, Protocol, TypeAlias

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.ports import InPort


class Motion(NamedTuple):
    """A measured coordinate and its rate: m and m/s, or rad and rad/s."""

    position: float
    rate: float


Profile: TypeAlias = Literal["trapezoid", "minimum-jerk"]
"""How the speed grows and falls on a way from rest to rest."""


class Setpoint(NamedTuple):
    """One coordinate: m, m/s and m/s2, or rad, rad/s and rad/s2."""

    position: float
    rate: float
    acceleration: float


class PoseSetpoint(NamedTuple):
    """A pose in the plane, in the axes of the room: x and y level, yaw from x to y."""

    x: Setpoint
    y: Setpoint
    yaw: Setpoint


class Path(Protocol):
    """Path of a pose, as a function of the path's own time."""

    @property
    def duration_s(self) -> float:
        """Return how long it takes; infinite for one without end."""

    def at(self, t_s: float) -> PoseSetpoint:
        """The setpoint at an instant, 0 or more; past the end, that of the end, at rest."""


def at_rest(position: float) -> Setpoint:
    """A coordinate that does not move."""
    return Setpoint(position, 0.0, 0.0)


class Applied(IntEnum):
    """Part of its commands that an actuator applies, until it says something else."""

    NOTHING = 0
    """It is off: not up, disabled, stopped, failed, or not commanded yet."""
    PART = 1
    """Less than commanded: a limit of size or of slew."""
    ALL = 2
    """What it is commanded to."""


class LeastApplied(Atomic):
    """Sends the least that any of several actuators applies, at first and when that changes.

    waiting --applied?--> sending (0), if that changes it --least!--> waiting

    An actuator that has said nothing yet counts as NOTHING. `applied` are the ports, by the
    actuators' names.
    """

    def __init__(self, name: str, actuators: Sequence[str]) -> None:
        super().__init__(name)
        self.applied: dict[str, InPort[Applied]] = {
            each: self.in_port(each, Applied) for each in actuators
        }
        self.least = self.out_port("least", Applied)
        self.said = dict.fromkeys(actuators, Applied.NOTHING)
        self.sent: Applied | None = None

    def output(self) -> None:
        """Send the least of what they said."""
        self.least.send(min(self.said.values()))

    def internal(self) -> None:
        """Wait for a change."""
        self.sent = min(self.said.values())
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take in what was said."""
        for name, port in self.applied.items():
            if port:
                self.said[name] = port[-1]
        if min(self.said.values()) is self.sent:
            self.continue_(elapsed)
        else:
            self.activate("sending")
