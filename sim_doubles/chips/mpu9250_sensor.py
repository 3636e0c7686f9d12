"""One sensor on the MPU-9250's die, from SI values to output words.

Its first-order lag stands in for the digital low-pass: a ramp comes out exactly the filter's delay
late. Then scale and bias (full scale, offset, self-test deflection), rounding and saturation.
"""

import math
from collections.abc import Sequence
from typing import TypeAlias

from firmware_runtime.devs.time import MILLISECOND, NEVER

Values: TypeAlias = tuple[float, ...]
"""One for each axis."""

LARGEST = 32767
LEAST_DELAY_MS = 0.02  # of the sensors themselves, without any filter
FORGOTTEN = 53 * math.log(2)
"""Time constants after which less than 2^-53 of a value is left."""


class Sensor:
    """Accelerometer, thermometer or gyroscope: off until switched on, then `start_up` ns silent."""

    def __init__(self, start_up: int, axes: int) -> None:
        self.ready_at = NEVER
        self._start_up = start_up
        self._gain = 1.0
        self.noise = 0.0
        """Standard deviation of white noise through the filter, of one of 1 in a root hertz."""
        self.memory = 0
        """Number of samples that the filter remembers."""
        self._scale = self._bias = (0.0,) * axes
        self.values: tuple[float, ...] | None = None
        """State of the filter, in SI units; None before the first sample."""
        self._counts: tuple[int, ...] | None = None
        """Those of the values, once worked out."""

    @property
    def on(self) -> bool:
        """Return whether the sensor is switched on, ready or not."""
        return self.ready_at != NEVER

    def switch(self, at: int, *, on: bool) -> None:
        """Start up or stop; a sensor that is in that state already is left alone."""
        if not on:
            self.ready_at, self.values = NEVER, None
        elif not self.on:
            self.ready_at = at + self._start_up

    def skip_start_up(self, at: int) -> None:
        """Be ready at once, as after a long time, if switched on."""
        self.ready_at = at if self.on else NEVER

    def forget(self) -> None:
        """Empty the filter; it starts over from the next sample."""
        self.values = None

    def configure(
        self, delay_ms: float, period: int, scale: tuple[float, ...], bias: tuple[float, ...]
    ) -> None:
        """Take the filter's delay, the sample period in ns, counts per SI unit, counts at 0."""
        self._gain = period / (period + delay_ms * MILLISECOND)
        delay_s = max(delay_ms, LEAST_DELAY_MS) / 1000
        self.noise = math.sqrt(1 / (4 * delay_s))
        lag = -math.log1p(-self._gain) if self._gain < 1 else math.inf
        self.memory = math.ceil(FORGOTTEN / lag)
        self._scale, self._bias = scale, bias
        self._counts = None

    def take(self, at: int, truth: tuple[float, ...]) -> None:
        """Let the lag follow the truth by one sample period."""
        if at < self.ready_at:
            return
        values = self.values
        if values is None:
            values = truth
        elif values == truth:
            return  # there is nothing to follow
        else:
            values = self._closer(values, truth, self._gain)
        self.values, self._counts = values, None

    def counts(self) -> tuple[int, ...]:
        """Return the output words; 0 before the first sample."""
        if self.values is None:
            return (0,) * len(self._scale)
        if self._counts is None:
            self._counts = self._words(self.values)
        return self._counts

    def noisy_counts(self, noise: Values) -> tuple[int, ...]:
        """Return the output words with this noise, in SI units, on what was measured."""
        if self.values is None:
            return (0,) * len(self._scale)
        return self._words([value + each for value, each in zip(self.values, noise, strict=True)])

    def _words(self, values: Sequence[float]) -> tuple[int, ...]:
        counts = self._rounded(values, self._scale, self._bias)
        if max(counts) > LARGEST or min(counts) < -LARGEST:
            return tuple([_saturated(count) for count in counts])
        return counts

    def _closer(self, values: Values, truth: Values, gain: float) -> Values:
        """Values that have come closer to the truth by a share of the distance."""
        return tuple([old + gain * (new - old) for old, new in zip(values, truth, strict=True)])

    def _rounded(self, values: Sequence[float], scales: Values, biases: Values) -> tuple[int, ...]:
        """The nearest words, beyond what a word holds as well."""
        axes = zip(values, scales, biases, strict=True)
        return tuple([round(value * scale + bias) for value, scale, bias in axes])


class TriaxialSensor(Sensor):
    """One of three axes, written out: it takes most of the samples' time."""

    def __init__(self, start_up: int) -> None:
        super().__init__(start_up, 3)

    def _closer(self, values: Values, truth: Values, gain: float) -> Values:
        (x, y, z), (to_x, to_y, to_z) = values, truth
        return x + gain * (to_x - x), y + gain * (to_y - y), z + gain * (to_z - z)

    def _rounded(self, values: Sequence[float], scales: Values, biases: Values) -> tuple[int, ...]:
        (x, y, z), (scale_x, scale_y, scale_z) = values, scales
        bias_x, bias_y, bias_z = biases
        return (
            round(x * scale_x + bias_x),
            round(y * scale_y + bias_y),
            round(z * scale_z + bias_z),
        )


def _saturated(count: int) -> int:
    return max(-LARGEST - 1, min(LARGEST, count))
