"""Drive without effect: a motor without supply, a gear that is broken, a robot that is caught.

What a chip was told it has taken, and all its registers read right: only the movement says that
nothing came of it. Whatever is driven by more than friction holds gains speed, so force times the
time in which it stands still is small; the watch adds that up.
"""

import math

from msgspec import Struct

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.wire_errors import Fault, Implausible
from firmware_runtime.models.motion import Applied, Motion

PAUSE = 100 * MILLISECOND
"""Ns after which a command that was not renewed drives nothing any more."""


class MovementWatchSettings(Struct, frozen=True, kw_only=True):
    """What has to move it, and when it stands still; `command` is N or N m, `rate` m/s or rad/s."""

    quantity: str
    """What stands still, for the fault: `yaw rate, rad/s`."""
    command: float
    """The least command that has to move it, friction included."""
    still: float
    """A rate below this is none."""
    impulse: float
    """Command beyond that, times seconds, without any movement, at most."""
    again: int
    """Ns after which it may be driven again, to see whether it moves."""


class MovementWatch(Atomic):
    """Says `moves` false, with a fault, once it is driven and stands still; true a while later.

    waiting --command?, motion?, applied?--> waiting, or stuck (0) --moves! false, fault!--> resting
    resting (again) --moves! true--> waiting

    A command counts until the next one, PAUSE at most, and only while the actuator applies it.
    """

    def __init__(self, name: str, settings: MovementWatchSettings) -> None:
        super().__init__(name)
        self.command = self.in_port("command", float)
        self.motion = self.in_port("motion", Motion)
        self.applied_in = self.in_port("applied", Applied)
        self.moves = self.out_port("moves", bool)
        self.fault = self.out_port("fault", Fault)
        self.settings = settings
        self._applied = Applied.ALL
        self._driven_by = self._impulse = self._rate = 0.0
        self._since_command = 0

    def initialize(self) -> None:
        """Wait for a command."""
        self.passivate("waiting")

    def output(self) -> None:
        """Send that it does not move, or that it may be tried again."""
        self.moves.send(self.phase == "resting")
        if self.phase == "stuck":
            self.fault.send(self._without_effect())

    def internal(self) -> None:
        """Rest after it was stuck, and wait after that."""
        if self.phase == "stuck":
            self.hold_in("resting", self.settings.again)
        else:
            self._forget()
            self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take what came; add up with every command, in line: it is done in every control tick."""
        self._since_command += elapsed
        if self.applied_in:
            self._applied = self.applied_in[-1]
        if self.motion:
            self._rate = self.motion[-1].rate
            if abs(self._rate) > self.settings.still:
                self._impulse = 0.0
        if self.phase != "waiting":
            self.continue_(elapsed)
        elif self.command:
            beyond = abs(self._driven_by) - self.settings.command
            if self._applied is Applied.NOTHING or self._since_command > PAUSE:
                self._forget()
            elif beyond > 0.0:
                more = beyond * self._since_command / SECOND
                self._impulse += math.copysign(more, self._driven_by)
            self._driven_by, self._since_command = self.command[-1], 0
            if abs(self._impulse) > self.settings.impulse:
                self.activate("stuck")

    # ---------------------------------------------------------------------------------------------

    def _forget(self) -> None:
        self._driven_by = self._impulse = 0.0

    def _without_effect(self) -> Fault:
        stated = self.settings
        expected = f"more than {stated.still:g} while it is driven by {self._driven_by:.3g}"
        error = Implausible(self.path, stated.quantity, self._rate, expected)
        return Fault.of(error, 1)
