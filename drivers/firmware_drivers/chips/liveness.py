"""Signs of life in raw readings: a sensor that works is never as quiet as one that hangs.

Two readings in a row of a living axis differ by fresh noise, whose standard deviation `fresh`, in
counts, the chip's driver takes from the data sheet (half of the typical value, for a quiet part,
less what a low-pass lets two readings share). A normal number of that deviation falls into one
given count with a probability of at most

    p = 1 / (fresh sqrt(2 pi)),

whatever came before; so an axis repeats itself n times in a row with p^n at most, and axes that do
so at the same time with the product. `Liveness` keeps that product, the odds that this is chance,
and calls a reading dead below `LEAST_ODDS`. Of six living axes the odds fall so low once in 2e13
readings: -log p^n of each is at most exponential, their sum a gamma variable of shape six, which
exceeds 45 with 5e-14. At 100 Hz, that is once in 6,000 years. One axis that stands still is found
after 45 / log(1/p) readings, all six within few, and an axis whose noise is below 0.4 counts never:
a lower range or a wider filter makes it speak.

A single stuck bit does not repeat a reading. Bits within the noise are nearly fair coins; every
`BITS_EVERY` readings a watch begins that ends when each of them has changed, which takes some ten.
One that has not in `BITS_WITHIN` is stuck: 2^-64 by chance.
"""

import math
from collections.abc import Sequence
from operator import and_, eq, or_, xor
from typing import Final

from firmware_runtime.hal.wire_errors import Implausible, Stuck
from firmware_runtime.system.elementary import exp

LEAST_ODDS: Final = 3e-20
BITS_EVERY: Final = 256
BITS_WITHIN: Final = 64
_QUIET_PART: Final = 0.5
"""Part of the typical noise of a data sheet."""

Counts = tuple[int, ...]


def fresh_noise(deviation: float, bandwidth_hz: float, rate_hz: float) -> float:
    """Deviation of what is new in a reading after a first-order low-pass, in the same unit.

    `deviation` is the data sheet's typical one, of which half is taken; two readings 1 / `rate_hz`
    apart share the rest.
    """
    shared = exp(-math.tau * bandwidth_hz / rate_hz)
    return _QUIET_PART * deviation * math.sqrt(1.0 - shared * shared)


class Liveness:
    """Watches the raw counts of the axes of one part, reading by reading.

    `fresh` is the deviation of each axis' fresh noise in counts. `repeats` is how often the same
    measurement may be read at most: 1 where every reading is a new one.
    """

    def __init__(
        self, place: str, axes: Sequence[str], fresh: Sequence[float], *, repeats: int = 1
    ) -> None:
        self._place = place
        self._axes = tuple(axes)
        self._odds_each = tuple(_odds(deviation, repeats) for deviation in fresh)
        self._bits = tuple(_bits_within(deviation) for deviation in fresh)
        self._bits_within = BITS_WITHIN * repeats
        self._last: Counts | None = None
        self._odds = [1.0] * len(self._axes)
        self._runs = [0] * len(self._axes)
        self._has_run = False
        self._changed: Counts = (0,) * len(self._axes)
        self._watched = 0
        """Readings since the watch of the bits began; negative until it does."""

    def restart(self) -> None:
        """Forget the last reading, as after a reset; what was stuck has yet to change."""
        self._last = None

    def check(self, counts: Counts) -> None:
        """Take one reading. Raises Stuck for one that repeats itself beyond chance."""
        last, self._last = self._last, counts
        if last is not None and True in map(eq, counts, last):
            self._count_runs(counts, last)
        elif last is not None and self._has_run:
            self._forget_runs()
        if self._has_run and self._product() < LEAST_ODDS:
            raise self._stuck(counts)
        if last is None:
            return
        self._watched += 1
        if self._watched > 0:
            self._watch_bits(counts, last)

    # ---------------------------------------------------------------------------------------------

    def _count_runs(self, counts: Counts, last: Counts) -> None:
        self._has_run = True
        for axis, odds in enumerate(self._odds_each):
            if counts[axis] == last[axis]:
                self._runs[axis] += 1
                self._odds[axis] *= odds
            else:
                self._runs[axis] = 0
                self._odds[axis] = 1.0

    def _forget_runs(self) -> None:
        self._has_run = False
        for axis in range(len(self._runs)):
            self._runs[axis] = 0
            self._odds[axis] = 1.0

    def _product(self) -> float:
        product = 1.0
        for odds in self._odds:
            product *= odds
        return product

    def _stuck(self, counts: Counts) -> Stuck:
        """The error, which names every axis that has stood still for as long as any."""
        longest = max(self._runs)
        still = [axis for axis, run in enumerate(self._runs) if run == longest]
        names = ", ".join(self._axes[axis] for axis in still)
        return Stuck(self._place, names, counts[still[0]], longest + 1)

    def _watch_bits(self, counts: Counts, last: Counts) -> None:
        """Collect which bits changed; the watch ends when all within the noise did."""
        self._changed = tuple(map(or_, self._changed, map(xor, counts, last)))
        if tuple(map(and_, self._changed, self._bits)) == self._bits:
            self._changed = (0,) * len(self._bits)
            self._watched = -BITS_EVERY
        elif self._watched > self._bits_within:
            for axis, (changed, bits) in enumerate(zip(self._changed, self._bits, strict=True)):
                still = bits & ~changed
                if still:
                    name = f"{self._axes[axis]} bit {still.bit_length() - 1}"
                    value = counts[axis] >> still.bit_length() - 1 & 1
                    raise Stuck(self._place, name, value, self._watched)


class MeanSquare:
    """Bounds the root mean square of three axes over many readings, and of each until it is back.

    For what lasts: a body at rest, or that does not speed up for seconds, feels one gravity.
    `unit` is that of a count times `scale`.
    """

    def __init__(  # noqa: PLR0913 -- a name, a unit, and two limits
        self,
        place: str,
        axis: str,
        unit: str,
        *,
        scale: float,
        limits: tuple[float, float],
        readings: int,
    ) -> None:
        self._place = place
        self._axis = axis
        self._scale = scale
        least, most = limits
        self._expected = f"{least:g} to {most:g} {unit} on average of {readings} readings"
        self._least, self._most = (limit * limit / (scale * scale) for limit in limits)
        self._readings = readings
        self._left = readings
        self._sum = 0
        self._off = 0
        """Readings for which it has been beyond; 0 while it is within."""

    def check(self, x: int, y: int, z: int) -> None:
        """Take one reading. Raises Implausible while the mean, then the reading, is beyond."""
        square = x * x + y * y + z * z
        if self._off:
            self._check(square)
        self._sum += square
        self._left -= 1
        if self._left == 0:
            mean, self._sum, self._left = self._sum / self._readings, 0, self._readings
            self._off = self._readings - 1
            self._check(mean)

    def _check(self, square: float) -> None:
        if self._least <= square <= self._most:
            self._off = 0
            return
        self._off += 1
        value = math.sqrt(square) * self._scale
        raise Implausible(self._place, self._axis, value, self._expected, readings=self._off)


def _odds(fresh: float, repeats: int) -> float:
    """Odds of one repeated reading: the probability of a repeated measurement, spread over them."""
    odds = min(1.0, 1.0 / (fresh * math.sqrt(math.tau))) if fresh > 0.0 else 1.0
    root = repeats
    while root > 1:  # a root of a power of two or more, so never less than the true one
        odds = math.sqrt(odds)
        root = (root + 1) // 2
    return odds


def _bits_within(fresh: float) -> int:
    """The lowest bits, as a mask, that the noise alone keeps changing."""
    return (1 << max(0, int(fresh).bit_length())) - 1
