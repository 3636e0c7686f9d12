"""Four forces become eight propeller duties on one PCA9685.

Each force is made by two propellers that blow against each other, at duties 0.5 + u/2 and
0.5 - u/2: zero net thrust is both at one half, turning. Safe is something else: full-off, and that
is what this model falls back to when forces stop coming, are not numbers, or cannot be written.
"""

import math
from typing import NamedTuple

from msgspec import Struct

from firmware_drivers.actuator import Actuator
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.interlock import Interlock, always_enabled
from firmware_runtime.hal.wire_errors import HalError, NotReady
from firmware_runtime.models.motion import Applied

PAIRS = 4
MOTORS = 2 * PAIRS
OFF = (0.0,) * MOTORS


class Forces(NamedTuple):
    """The force of each pair in N, positive when its first propeller is the stronger."""

    f1: float
    f2: float
    f3: float
    f4: float


class ThrustSettings(Struct, frozen=True):
    """Forces of a pair and their greatest rate of change."""

    pair_thrust_n: float
    """Force of a pair with one propeller at full duty and the other at none, N."""
    frequency_hz: float
    """PWM frequency."""
    slew_per_s: float
    """Fastest change of a duty, full range per second."""
    timeout: int
    """Ns without a new force vector after which all propellers are switched off."""
    first_channel: int
    """Propellers are on this channel and the seven after it, two neighbours to a pair."""


class ThrustPairs(Actuator):
    """Writes one burst a force vector and reports the duties the chip really has.

    off, driving --forces?--> reporting (0) --duties!, fault!--> driving (timeout)
    driving --(timeout)--> stopped --> reporting --duties!, fault!--> off
    driving --enable? false--> stopped --> reporting --duties!--> off, until enable? true

    Where nothing is coupled to `enable` they are enabled. The other phases are those of `Actuator`;
    forces are taken while a stop is repeated too. A command is stale at once: forces that come
    while outputs are disabled or the chip is not up have no effect. While a stop is not
    acknowledged the chip's duties are not known, and none are sent.
    """

    def __init__(
        self,
        name: str,
        chip: Pca9685,
        settings: ThrustSettings,
        interlock: Interlock = always_enabled,
    ) -> None:
        chip.users.add(name, stops_all=True)
        super().__init__(name, lambda: chip.bring_up(settings.frequency_hz), chip.line, interlock)
        self.forces = self.in_port("forces", Forces)
        self.enable = self.in_port("enable", bool)
        self.duties_out = self.out_port("duties", tuple)
        self.chip = chip
        self.settings = settings
        self.duties: tuple[float, ...] = OFF
        self._is_enabled = True
        self._since_write = 0

    def output(self) -> None:
        """Report the duties just written, where known, and the faults if there were any."""
        super().output()
        if self.phase == "reporting" and not self.is_stop_due:
            self.duties_out.send(self.duties)

    def external(self, elapsed: int) -> None:
        """Write the newest force vector; while the chip is not up, forces have no effect."""
        self._since_write += elapsed
        self.since_poll += elapsed
        if self.enable:
            self._is_enabled = self.enable[-1]
        if self.phase.startswith("bring_up"):
            self.continue_(elapsed)
        elif self.forces:
            self._obey(self.forces[-1])
            self.activate("reporting")
        elif self._is_enabled or not any(self.duties):
            self.continue_(elapsed)
        else:
            self.stop()

    def settle(self) -> None:
        """Wait for forces, for no longer than the timeout while propellers turn."""
        if any(self.duties):
            self.hold_in("driving", self.settings.timeout)
        else:
            self.passivate("off")

    def drive_on(self) -> None:
        """Stop: forces have not come."""
        timeout_s = self.settings.timeout / SECOND
        self.note(NotReady(f"no forces for {timeout_s:g} s; all off", where=self.path))
        self.stop()

    def poll(self) -> None:
        """Check that the chip was neither reset nor inverted."""
        self.chip.poll()

    def write_stop(self) -> None:
        """Turn all sixteen channels full-off."""
        self.duties = OFF
        self.chip.stop_all()

    # ---------------------------------------------------------------------------------------------

    def _obey(self, forces: Forces) -> None:
        if not all(map(math.isfinite, forces)):
            self.note(
                NotReady(f"forces {tuple(forces)} N", where=self.path, expected="finite numbers")
            )
            self.stop()
        elif self._is_enabled and self.interlock():
            self._drive(forces)
        elif any(self.duties) or self.is_stop_due:
            self.stop()

    def _drive(self, forces: Forces) -> None:
        most = self.settings.pair_thrust_n
        wanted = duties_of(forces, most)
        slewed = self._slewed(wanted)
        try:
            self.duties = self.chip.set_duties(self.settings.first_channel, slewed)
            self.poll_if_due()
        except HalError as error:
            self.fail(error)
        else:
            is_whole = slewed == wanted and -most <= min(forces) and max(forces) <= most
            self.note_success(Applied.ALL if is_whole else Applied.PART)
        self._since_write = 0

    def _slewed(self, wanted: tuple[float, ...]) -> tuple[float, ...]:
        """The duties of this write; of the time spent off, no more counts than `timeout`."""
        elapsed = min(self._since_write, self.settings.timeout)
        step = self.settings.slew_per_s * elapsed / SECOND
        if step >= 1.0:  # the whole range of a duty
            return wanted
        return tuple(
            [
                max(now - step, min(now + step, want))
                for now, want in zip(self.duties, wanted, strict=True)
            ]
        )


def duties_of(forces: Forces, pair_thrust_n: float) -> tuple[float, ...]:
    """Eight duties for four forces, each clipped to what a pair can do.

    A propeller's thrust grows with the square of its duty, so a pair about one half is linear.
    """
    duties: list[float] = []
    for force in forces:
        half = 0.5 * force / pair_thrust_n
        if not -0.5 <= half <= 0.5:
            half = math.copysign(0.5, half)
        duties.append(0.5 + half)
        duties.append(0.5 - half)
    return tuple(duties)
