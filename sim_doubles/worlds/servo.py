"""A servo as a plant: turns evenly to the angle that its pulse stands for; limp without pulses.

Not modelled: mass and load, dead band, gear play, the analogue servo's pulse-to-pulse drive. A limp
servo stays where it is, as one without load does.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from firmware_runtime.devs.time import SECOND
from sim_doubles.chips.pca9685 import Pca9685Double

PulseUs: TypeAlias = Callable[[], float]
"""The pulse's length now in us; 0 without pulses."""


def pulse_of(chip: Pca9685Double, channel: int) -> PulseUs:
    """Return the pulse that a servo at an output of a PCA9685 receives."""

    def pulse_us() -> float:
        return chip.duty(channel) / chip.frequency_hz * 1e6 if chip.running else 0.0

    return pulse_us


@dataclass(frozen=True, slots=True, kw_only=True)
class ServoParameters:
    """A servo's travel and speed; the defaults are those of a common small one."""

    least_rad: float = -1.5708
    most_rad: float = 1.5708
    """Its end stops."""
    least_pulse_us: float = 500.0
    """Pulse that turns it to `least_rad`."""
    most_pulse_us: float = 2500.0
    """Pulse that turns it to `most_rad`."""
    speed_rad_s: float = 8.7
    """60 degrees in 0.12 s."""
    start_rad: float = 0.0


class ServoPlant:
    """Turns as its pulse says; `advance` must be called before the pulse changes.

    `angle_rad` may be read for any instant since the last `advance`.
    """

    def __init__(self, parameters: ServoParameters, pulse_us: PulseUs) -> None:
        self._parameters = parameters
        self._pulse_us = pulse_us
        self._angle_rad = parameters.start_rad
        self._since = 0
        self._is_held = False

    def advance(self, at: int) -> None:
        """Turn on to an instant, by the pulse there has been."""
        self._angle_rad = self.angle_rad(at)
        self._since = at

    def push(self, turn_rad: float) -> None:
        """Turn its horn by force, as far as its stops; it goes back as fast as it can."""
        given = self._parameters
        pushed = self._angle_rad + turn_rad
        self._angle_rad = max(given.least_rad, min(given.most_rad, pushed))

    def hold(self, *, is_held: bool) -> None:
        """Let its horn be caught in something, or free again."""
        self._is_held = is_held

    def angle_rad(self, at: int) -> float:
        """Return its pose at an instant."""
        if self._is_held:
            return self._angle_rad
        reach = self._parameters.speed_rad_s * (at - self._since) / SECOND
        target = self._target_rad()
        return max(self._angle_rad - reach, min(self._angle_rad + reach, target))

    def _target_rad(self) -> float:
        pulse_us, given = self._pulse_us(), self._parameters
        if pulse_us <= 0:
            return self._angle_rad
        span_us = given.most_pulse_us - given.least_pulse_us
        share = (pulse_us - given.least_pulse_us) / span_us
        angle = given.least_rad + share * (given.most_rad - given.least_rad)
        return max(given.least_rad, min(given.most_rad, angle))
