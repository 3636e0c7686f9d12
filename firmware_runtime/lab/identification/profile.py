"""Intervals by a profile: static friction is walked over, and at each all else is fitted again.

Where a body sticks and breaks away, the output is no smooth function of static friction, so no
straight line says how sure that is. All else is as good as linear while it is held, so each held
value gives each other number an interval of its own: as wide as what it lacks in fit leaves over.
The interval of a number is all of these together.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.stats import t as student

from firmware_runtime.lab.identification.noise import Noise
from firmware_runtime.lab.identification.plant import Numbers, Places
from firmware_runtime.lab.identification.search import COULOMB, EXCESS, PLANT, STEP, Search

_NO_DIFFERENCE: Final = 1e-3
"""A value whose whole scale moves the output by less of the noise than this is not seen in it."""
_BETTER: Final = 0.25
"""Variances by which what the walk finds is to fit better than what it began with."""
_BEYOND: Final = 3
"""So many values in a row that do not fit, each twice as far, and no further one is tried."""
_STEPS: Final = 24
_HALVINGS: Final = 5
_CHORDS: Final = 4
_SETTLED: Final = 0.02
"""Variances that a further step would gain, below which all else is fitted."""
_RANK: Final = 1e-9
_SMALL, _LARGE = 0.3, 1.5
"""Change of the fit that a step of the walk is to make, in variances; else the next is another."""


@dataclass(frozen=True, slots=True)
class Intervals:
    """The ends for inertia, damping, coulomb, static and delay; infinite where nothing bounds."""

    low: Numbers
    high: Numbers


class Profile:
    """The walk over static friction from the best values, both ways."""

    def __init__(self, search: Search, noise: Noise, values: Numbers, confidence: float) -> None:
        self._search, self._noise, self._values = search, noise, values
        self._least = search.squares(noise, values)
        self._best = (0.0, values)
        freedom = len(search.model.residuals(values)) - 2 * len(noise.weights) - len(values)
        self._variance = self._least / freedom or float(np.finfo(float).tiny)
        self._bound = float(student.ppf(0.5 + confidence / 2, freedom)) ** 2
        self._others = np.flatnonzero(np.arange(len(values)) != EXCESS)
        self._steps = STEP * search.scale
        for _ in range(2):
            every = self._sensitivity(values, np.arange(len(values)))
            deviations = self._deviations(every)
            wide = 0.5 * deviations * search.scale
            self._steps = np.maximum(self._steps, np.where(np.isfinite(wide), wide, 0.0))
        self._first_step = self._chosen_step(float(deviations[EXCESS] * search.scale[EXCESS]))
        self._near = every[:, self._others]
        self._low, self._high = np.full(PLANT, np.inf), np.full(PLANT, -np.inf)

    def run(self) -> Numbers | None:
        """Walk both ways; the values that fit better than those it began with, if some do."""
        self._keep(self._values, 0.0)
        for sense in (-1.0, 1.0):
            self._walk(sense)
        return self._best[1] if self._best[0] < -_BETTER else None

    @property
    def intervals(self) -> Intervals:
        """Intervals that the walk found, no end below 0."""
        return Intervals(np.maximum(self._low, 0.0), self._high)

    def _walk(self, sense: float) -> None:
        """Out to where nothing fits any more, or static friction makes no more difference."""
        values, lack, step, beyond = self._values, 0.0, self._first_step, 0
        for _ in range(_STEPS):
            if sense < 0.0 and values[EXCESS] <= 0.0:
                return
            following, further = self._held(values, values[EXCESS] + sense * step)
            beyond = beyond + 1 if further > self._bound else 0
            if beyond == 0:
                self._keep(following, further)
            elif beyond == 1:
                self._edge(values, following)
            elif beyond == _BEYOND:
                return
            step *= 2.0 if beyond else _following(abs(further - lack))
            values, lack = following, further
        if sense > 0.0:
            self._high[EXCESS] = np.inf

    def _edge(self, inside: Numbers, outside: Numbers) -> None:
        """Keep the last that fits between two, one of which does."""
        fitting: list[tuple[Numbers, float]] = []
        for _ in range(_HALVINGS):
            middle, lack = self._held(inside, 0.5 * (inside[EXCESS] + outside[EXCESS]))
            if lack > self._bound:
                outside = middle
            else:
                inside = middle
                fitting.append((middle, lack))
        if fitting:
            self._keep(*fitting[-1])

    def _held(self, near: Numbers, excess: float) -> tuple[Numbers, float]:
        """All else fitted, and how much worse that fits than the best, in variances."""
        values = self._fitted(near, max(excess, 0.0))
        squares = self._search.squares(self._noise, values)
        lack = (squares - self._least) / self._variance
        self._best = min(self._best, (lack, values), key=lambda each: each[0])
        return values, lack

    def _fitted(self, near: Numbers, excess: float) -> Numbers:
        """By the sensitivity of what was kept last, as far as that leads; else by a search."""
        values = near.copy()
        values[EXCESS] = excess
        for _ in range(_CHORDS):
            white = self._noise.whitened(self._search.model.residuals(values))
            change, *_ = np.linalg.lstsq(self._near, white, rcond=_RANK)
            gain = float(change @ (self._near.T @ white)) / self._variance
            if gain < _SETTLED:
                return values
            values[self._others] += change * self._search.scale[self._others]
            values = self._search.within(values, near)
        return self._search.solved(self._noise, values, held=EXCESS)

    def _keep(self, values: Numbers, lack: float) -> None:
        """Let the intervals hold what fits while static friction exceeds Coulomb's so far."""
        self._near = self._sensitivity(values, self._others)
        apart = np.zeros(len(values))
        apart[self._others] = self._deviations(self._near) * self._search.scale[self._others]
        apart *= np.sqrt(max(self._bound - lack, 0.0))
        middle = values.copy()
        middle[EXCESS], apart[EXCESS] = values[COULOMB] + values[EXCESS], apart[COULOMB]
        self._low = np.minimum(self._low, (middle - apart)[:PLANT])
        self._high = np.maximum(self._high, (middle + apart)[:PLANT])

    def _sensitivity(self, values: Numbers, places: Places) -> Numbers:
        return self._search.sensitivity(self._noise, values, self._steps, places)

    def _deviations(self, sensitivity: Numbers) -> Numbers:
        """Deviation of each, in scales, the others not known; infinite for one that is not seen."""
        seen = np.linalg.norm(sensitivity, axis=0) > _NO_DIFFERENCE * np.sqrt(self._variance)
        found = np.full(len(seen), np.inf)
        kept = sensitivity[:, seen]
        found[seen] = np.sqrt(np.diag(np.linalg.pinv(kept.T @ kept)) * self._variance)
        return found

    def _chosen_step(self, deviation: float) -> float:
        """Half a deviation, if that is less than a tenth of static friction."""
        tenth = 0.1 * float(self._values[COULOMB] + self._values[EXCESS])
        return max(min(0.5 * deviation, tenth), float(STEP * self._search.scale[EXCESS]))


def _following(change: float) -> float:
    """Return how much wider the next step is than the one that changed the fit so much."""
    if change > _LARGE:
        return 0.6
    return 2.0 if change < _SMALL else 1.0
