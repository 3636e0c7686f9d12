"""How much of its commands an actuator applies: what a controller must know before it learns.

A command without effect teaches nothing. An actuator says at its port `applied` whether it applies
what it is commanded to; whatever goes on by what was commanded follows that: integrals, predictors,
estimators that have nothing but the command, references in time. They stand still while nothing is
applied, so that the time a robot spends disarmed changes no later answer.

It is said in terms that need no conversion on the way back: it holds for every unit, sign and axis
that the command had on its way.
"""

from collections.abc import Sequence
from enum import IntEnum

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.ports import InPort


class Applied(IntEnum):
    """How much of its commands an actuator applies, until it says something else."""

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
