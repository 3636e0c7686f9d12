"""Four forces become eight propeller duties on one PCA9685.

Each force is made by two propellers that blow against each other, at duties 0.5 + u/2 and
0.5 - u/2: zero net thrust is both at one half, turning. Safe is something else: full-off, and that
is what this model falls back to when forces stop coming, are not numbers, or cannot be written.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from drivers.chips.pca9685 import LOOK_EVERY_NS, Pca9685
from drivers.hardware import HardwareModel
from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.errors import HalError, NotReady
from firmware_runtime.hal.interlock import Interlock, always_enabled

PAIRS = 4
MOTORS = 2 * PAIRS
OFF = (0.0,) * MOTORS


class Forces(NamedTuple):
    """The force of each pair in N, positive when its first propeller is the stronger."""

    f1: float
    f2: float
    f3: float
    f4: float


@dataclass(frozen=True, slots=True)
class ThrustSettings:
    """What a pair can do and how fast it may change."""

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


class ThrustPairs(HardwareModel):
    """Writes one burst a force vector and reports the duties the chip really has.

    bring_up (the steps' waits) --> off;  a step failed --fault!--> bring_up (RETRY_AFTER)
    off, driving --forces?--> reporting (0) --duties!, fault!--> driving (timeout)
    driving --(timeout)--> reporting --duties!, fault!--> off, or stopping while the chip is silent
    driving, the chip was reset --> reporting --duties!, fault!--> bring_up

    Without leave (`interlock`) forces have no effect: all is off, or is switched off.
    """

    def __init__(
        self,
        name: str,
        chip: Pca9685,
        settings: ThrustSettings,
        interlock: Interlock = always_enabled,
    ) -> None:
        super().__init__(name, lambda: chip.bring_up(settings.frequency_hz), chip.line)
        self.forces = self.in_port("forces", Forces)
        self.duties_out = self.out_port("duties", tuple)
        self.chip = chip
        self.settings = settings
        self.interlock = interlock
        self.duties: tuple[float, ...] = OFF
        self.is_stopped = True
        self._since_write = self._since_look = 0
        self._is_bring_up_due = False

    def begin(self) -> None:
        """Wait for forces, all off."""
        self.is_stopped = True
        self._is_bring_up_due = False
        self._since_look = 0
        self.passivate("off")

    def output(self) -> None:
        """Report the duties just written, and the faults if there were any."""
        super().output()
        if self.phase == "reporting":
            self.duties_out.send(self.duties)

    def proceed(self) -> None:
        """Wait for forces again, or stop because they have not come."""
        if self.phase == "reporting":
            self._wait_for_forces()
            return
        if self.phase == "driving":
            timeout_s = self.settings.timeout / SECOND
            self.note(NotReady(f"{self.path}: no forces for {timeout_s:g} s; all off"))
        self._stop()
        self.activate("reporting")

    def external(self, elapsed: int) -> None:
        """Write the newest force vector; while the chip is not up, forces have no effect."""
        self._since_write += elapsed
        self._since_look += elapsed
        if self.phase.startswith("bring_up"):
            self.continue_(elapsed)
        else:
            self.faults.clear()
            self._drive(self.forces[-1])
            self.activate("reporting")

    def exit(self) -> None:
        """Leave all sixteen channels full-off."""
        self.chip.stop_all()

    # ---------------------------------------------------------------------------------------------

    def _wait_for_forces(self) -> None:
        if self._is_bring_up_due:
            self.bring_up_again()
        elif any(self.duties):
            self.hold_in("driving", self.settings.timeout)
        elif self.is_stopped:
            self.passivate("off")
        else:
            self.hold_in("stopping", self.settings.timeout)

    def _drive(self, forces: Forces) -> None:
        if not all(map(math.isfinite, forces)):
            self.note(NotReady(f"{self.path}: forces {tuple(forces)} N, expected finite numbers"))
            self._stop()
            return
        if not self.interlock():
            if not self.is_stopped:
                self._stop()
            return
        wanted = duties_of(forces, self.settings.pair_thrust_n)
        try:
            self.duties = self.chip.set_duties(self.settings.first_channel, self._slewed(wanted))
            self._look()
        except HalError as error:
            self.note(error)
            self._since_look = LOOK_EVERY_NS
            self._is_bring_up_due = isinstance(error, NotReady)
            self._stop()
        else:
            self.is_stopped = False
            self.consecutive_faults = 0
        self._since_write = 0

    def _look(self) -> None:
        """Look at the chip now and then, and after a write that failed: it may have been reset."""
        if self._since_look >= LOOK_EVERY_NS:
            self.chip.look()
            self._since_look = 0

    def _slewed(self, wanted: tuple[float, ...]) -> tuple[float, ...]:
        step = self.settings.slew_per_s * self._since_write / SECOND
        return tuple(
            max(now - step, min(now + step, want))
            for now, want in zip(self.duties, wanted, strict=True)
        )

    def _stop(self) -> None:
        self.duties = OFF
        try:
            self.chip.stop_all()
        except HalError as error:
            self.is_stopped = False
            self.note(error)
        else:
            self.is_stopped = True


def duties_of(forces: Forces, pair_thrust_n: float) -> tuple[float, ...]:
    """Eight duties for four forces, each clipped to what a pair can do.

    A propeller's thrust grows with the square of its duty, so a pair about one half is linear.
    """
    duties: list[float] = []
    for force in forces:
        half = max(-0.5, min(0.5, 0.5 * force / pair_thrust_n))
        duties += (0.5 + half, 0.5 - half)
    return tuple(duties)
