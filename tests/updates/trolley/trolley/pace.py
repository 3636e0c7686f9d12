"""The controller: forward while the wall is far, back while it is near."""

import math

from firmware_drivers.treads import TreadSpeeds

from firmware_runtime.devs.atomic import Atomic


class Pace(Atomic):
    """Sends both speeds every period, by the last distance.

    waiting (period) --speeds!--> waiting;  waiting --distance?--> the same
    """

    def __init__(self, name: str, period: int, wanted_m: float, per_m: float) -> None:
        super().__init__(name)
        self.period = period
        self.wanted_m = wanted_m
        self.per_m = per_m
        self.distance = self.in_port("distance", float)
        self.speeds = self.out_port("speeds", TreadSpeeds)
        self.started = self.out_port("start", int)
        self.steps = 0
        self._speed = 0.0

    def initialize(self) -> None:
        """Begin at once."""
        self.activate("waiting")

    def output(self) -> None:
        """Send the speeds; the sonar's start before them, once."""
        if self.steps == 0:
            self.started.send(1)
        self.speeds.send(TreadSpeeds(self._speed, self._speed))

    def internal(self) -> None:
        """Wait for the next period."""
        self.steps += 1
        self.hold_in("waiting", self.period)

    def external(self, elapsed: int) -> None:
        """Take the distance; no echo is no wall, and no reason to hurry."""
        found = self.distance[-1]
        off = found - self.wanted_m if math.isfinite(found) else 0.0
        self._speed = max(-1.0, min(1.0, self.per_m * off))
        self.continue_(elapsed)
