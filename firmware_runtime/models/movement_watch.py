"""Drive without effect, or without end: a motor without supply, a robot that is caught, or spins.

What a chip was told it has taken, and all its registers read right: only the movement says that
nothing came of it. Whatever is driven by more than friction holds gains speed, so force times the
time in which it stands still is small; the watch adds that up. And a robot that is led by a rate of
the wrong sign is driven faster and faster: by either sign it is soon faster than it is ever told.
"""

import math

from msgspec import Struct

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.wire_errors import Fault, Implausible
from firmware_runtime.models.motion import Applied, Motion

PAUSE = 100 * MILLISECOND
"""Ns after which a command that was not renewed drives nothing any more."""
FAST_FOR = 100 * MILLISECOND
"""Ns for which a rate has to be too great: one reading may be wrong."""


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
    fastest: float = math.inf
    """A rate beyond this it never has, unless something is wrong."""
    again: int
    """Ns after which it may be driven again, to see whether it moves."""


class MovementWatch(Atomic):
    """Says `moves` false, with a fault, once it is driven and stands still; true a while later.

    waiting --command?, motion?, applied?--> waiting, or stuck (0) --moves! false, fault!--> resting
    resting (again) --moves! true--> waiting

    It says the same of what is too fast, driven or not, for as long as it is.

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
        self._since_command = self._fast_for = 0

    def initialize(self) -> None:
        """Wait for a command."""
        self.passivate("waiting")

    def output(self) -> None:
        """Send that it does not move, or that it may be tried again."""
        self.moves.send(self.phase == "resting" and not self._is_too_fast)
        if self.phase == "stuck":
            self.fault.send(self._found())

    def internal(self) -> None:
        """Rest after it was stuck, and wait after that."""
        if self.phase == "stuck":
            self.hold_in("resting", self.settings.again)
        elif self._is_too_fast:
            self.activate("stuck")
        else:
            self._forget()
            self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Take what came; add up with every command."""
        self._since_command += elapsed
        if abs(self._rate) > self.settings.fastest:
            self._fast_for += elapsed
        if self.applied_in:
            self._applied = self.applied_in[-1]
        if self.motion:
            self._take_rate(self.motion[-1].rate)
        if self.phase != "waiting":
            self.continue_(elapsed)
            return
        if self.command:
            self._take_command(self.command[-1])
        if self._is_too_fast or abs(self._impulse) > self.settings.impulse:
            self.activate("stuck")

    def _take_rate(self, rate: float) -> None:
        self._rate = rate
        if abs(rate) > self.settings.still:
            self._impulse = 0.0
        if abs(rate) <= self.settings.fastest:
            self._fast_for = 0

    def _take_command(self, command: float) -> None:
        beyond = abs(self._driven_by) - self.settings.command
        if self._applied is Applied.NOTHING or self._since_command > PAUSE:
            self._forget()
        elif beyond > 0.0:
            more = beyond * self._since_command / SECOND
            self._impulse += math.copysign(more, self._driven_by)
        self._driven_by, self._since_command = command, 0

    # ---------------------------------------------------------------------------------------------

    def _forget(self) -> None:
        self._driven_by = self._impulse = 0.0

    @property
    def _is_too_fast(self) -> bool:
        return self._fast_for > FAST_FOR

    def _found(self) -> Fault:
        stated = self.settings
        expected = f"more than {stated.still:g} while it is driven by {self._driven_by:.3g}"
        if self._is_too_fast:
            expected = f"{stated.fastest:g} at most"
        return Fault.of(Implausible(self.path, stated.quantity, self._rate, expected), 1)
