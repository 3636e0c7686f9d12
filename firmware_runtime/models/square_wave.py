"""A square wave as an atomic model: what an actuator gets in open loop, to see what it does."""

from dataclasses import dataclass

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.models.motion import Applied


@dataclass(frozen=True, slots=True)
class Wave:
    """Its level is `amplitude` and minus it, half a period each; 0 before it and after it.

    The first and the last level take a quarter of a period only: the rate of a body that is pushed
    by it without friction swings about zero, and the body ends where it began.
    """

    amplitude: float
    period: int
    """Ns."""
    begin: int
    """Ns since the start; later, where nothing is applied by then."""
    cycles: int

    def level(self, at: int) -> float:
        """The level at an instant."""
        since = at - self.begin
        if not 0 <= since < self.cycles * self.period:
            return 0.0
        is_first_half = (since + self.period // 4) % self.period < self.period // 2
        return self.amplitude if is_first_half else -self.amplitude


class SquareWave(Atomic):
    """Answers every tick with the wave's level then, at the same instant.

    waiting --tick?--> sending (0) --level!--> waiting

    Once it has begun, its time stands still while an actuator says at `applied` that it applies
    nothing: otherwise it would be over before the robot is armed.
    """

    def __init__(self, name: str, ticks: type[object], wave: Wave) -> None:
        super().__init__(name)
        self.tick = self.in_port("tick", ticks)
        self.applied_in = self.in_port("applied", Applied)
        self.level_out = self.out_port("level", float)
        self.wave = wave
        self.level = 0.0
        self.applied = Applied.ALL
        self._at = 0

    def output(self) -> None:
        """Send the level."""
        self.level_out.send(self.level)

    def internal(self) -> None:
        """Wait for the next tick."""
        self.passivate("waiting")

    def external(self, elapsed: int) -> None:
        """Look the level up."""
        begin = self.wave.begin
        if self.applied is not Applied.NOTHING:
            self._at += elapsed
        elif self._at < begin:
            self._at = min(begin, self._at + elapsed)
        if self.applied_in:
            self.applied = self.applied_in[-1]
        if self.tick:
            self.level = self.wave.level(self._at)
            self.activate("sending")
        else:
            self.continue_(elapsed)
