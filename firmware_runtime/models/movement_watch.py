"""Drive without effect: a motor without supply, a robot that is caught, a sensor of the other sign.

What a chip was told it has taken, and all its registers read right: only the movement says that
nothing came of it. Whatever is driven by more than friction holds gains speed, and whatever is
braked loses it, so force times the time in which it does neither is small; the watch adds that up.
A push adds speed at once, which is then braked; what gains it while it is braked is no push. Each
further try would make that faster: braked in vain a second time, and never half as fast in between,
it is given up.
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
    """A rate below this is none; one that falls by twice as much has fallen."""
    impulse: float
    """Command beyond that, times seconds, without any movement or braking, at most."""
    again: int
    """Ns after which it may be driven again, to see whether it moves."""


class MovementWatch(Atomic):
    """Says `moves` false, with a fault, once it is driven in vain; true a while later.

    waiting --command?, motion?, applied?--> waiting, or stuck (0) --moves! false, fault!--> resting
    resting (again) --moves! true--> waiting
    waiting, braked in vain before --command?--> in vain (0) --moves! false, fault!,
        contradiction!--> given up

    A command counts until the next one, PAUSE at most, and only while the actuator applies it.
    """

    def __init__(self, name: str, settings: MovementWatchSettings) -> None:
        super().__init__(name)
        self.command = self.in_port("command", float)
        self.motion = self.in_port("motion", Motion)
        self.applied_in = self.in_port("applied", Applied)
        self.moves = self.out_port("moves", bool)
        self.fault = self.out_port("fault", Fault)
        self.contradiction = self.out_port("contradiction", Fault)
        self.settings = settings
        self._applied = Applied.ALL
        self._driven_by = self._impulse = self._rate = 0.0
        self._fastest = settings.still
        """How fast it was against what drives it, since that has slowed it down."""
        self._in_vain_at = 0.0
        """The speed at which it was last braked in vain; 0 once it has been half as fast."""
        self._since_command = 0

    def initialize(self) -> None:
        """Wait for a command."""
        self.passivate("waiting")

    def output(self) -> None:
        """Send that it does not move, or that it may be tried again."""
        self.moves.send(self.phase == "resting")
        if self.phase != "resting":
            fault = self._without_effect()
            self.fault.send(fault)
            if self.phase == "in vain":
                self.contradiction.send(fault)

    def internal(self) -> None:
        """Rest after it was stuck, and wait after that; for good, where it was braked in vain."""
        if self.phase == "stuck":
            self.hold_in("resting", self.settings.again)
        elif self.phase == "in vain":
            self.passivate("given up")
        else:
            self._forget()
            self.passivate("waiting")

    def external(self, elapsed: int) -> None:  # noqa: C901 -- in one frame: in every control tick
        """Take what came; add up with every command."""
        still = self.settings.still
        self._since_command += elapsed
        if self.applied_in:
            self._applied = self.applied_in[-1]
        if self.motion:
            self._rate = self.motion[-1].rate
            against = self._rate * math.copysign(1.0, -self._driven_by)
            if against > self._fastest:
                self._fastest = against
            elif against < self._fastest - 2 * still:  # slower; or, from rest, as it is driven
                self._impulse, self._fastest = 0.0, max(against, still)
                if abs(self._rate) < self._in_vain_at / 2:
                    self._in_vain_at = 0.0
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
                self._stop()

    # ---------------------------------------------------------------------------------------------

    def _forget(self) -> None:
        self._driven_by = self._impulse = 0.0
        self._fastest = self.settings.still

    def _stop(self) -> None:
        if not self._is_braked():
            self.activate("stuck")
            return
        self.activate("in vain" if self._in_vain_at else "stuck")
        self._in_vain_at = self._fastest

    def _is_braked(self) -> bool:
        return self._fastest > self.settings.still

    def _without_effect(self) -> Fault:
        stated = self.settings
        moved = "slowing down" if self._is_braked() else f"more than {stated.still:g}"
        expected = f"{moved} while it is driven by {self._driven_by:.3g}"
        error = Implausible(self.path, stated.quantity, self._rate, expected)
        return Fault.of(error, 1)
