"""The second look: an echo that stops the head has to be heard by one of the next two pings, too.

One echo alone may be none, and there is no time for two before the head is past a target that is
far away. So it stops at the first, and what is heard then says whether that was right. One ping
that hears nothing may be wrong, too: a sonar whose supply fails as it ranges answers at once, and
has heard none.
"""

import math
from typing import Final

from firmware_drivers.motors import STILL

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.hal.wire_errors import Fault, Implausible

LOOKS: Final = 2
"""So many pings in a row hear nothing of what was found, and it is doubted."""


class SecondLook(Atomic):
    """Waits for the pings after a detection while the head turns.

    watching --detected? while the head turns, then distance? none LOOKS times--> doubting (0)
        --fault!--> watching

    `head` takes the commands to its motor, `distance` each ping's, in m, +inf for no echo.
    """

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.head = self.in_port("head", int)
        self.detected = self.in_port("detected", int)
        self.distance = self.in_port("distance", float, takes="infinities")
        self.fault = self.out_port("fault", Fault)
        self._turns = False
        self._found_m: float | None = None
        """What was found while the head turned, until it is heard once more, or doubted."""
        self._unheard = 0
        """Pings since then that heard nothing."""

    def initialize(self) -> None:
        """Wait for a detection."""
        self.passivate("watching")

    def output(self) -> None:
        """Say that what was found is not there."""
        if self._found_m is not None:
            expected = "heard by one of the next two pings, too"
            error = Implausible(self.path, "what stopped the head (m)", self._found_m, expected)
            self.fault.send(Fault.of(error, 1))

    def internal(self) -> None:
        """Go on."""
        self._found_m, self._unheard = None, 0
        self.passivate("watching")

    def external(self, elapsed: int) -> None:
        """Take commands and pings; a command at the instant of a ping is obeyed after it."""
        is_doubtful = False
        if self.distance:
            is_doubtful = self._is_doubtful(self.distance[-1])
        if self.head:
            self._turns = self.head[-1] != STILL
        if is_doubtful:
            self.activate("doubting")
        else:
            self.continue_(elapsed)

    def _is_doubtful(self, distance_m: float) -> bool:
        """Take the distance of a ping; return whether what was found is doubted by it."""
        if self._found_m is not None and math.isinf(distance_m):
            self._unheard += 1
            return self._unheard >= LOOKS
        self._found_m = distance_m if self.detected and self._turns else None
        self._unheard = 0
        return False
