"""The search for the values with the least squares of whitened residuals: scipy's, in bounds."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from firmware_runtime.lab.identification.motion import motion
from firmware_runtime.lab.identification.noise import Noise
from firmware_runtime.lab.identification.plant import NAMES, Numbers, Places, PlantParameters
from firmware_runtime.lab.identification.recorded_series import Series
from firmware_runtime.lab.identification.regression import MOST_DELAY_S
from firmware_runtime.lab.identification.stretches import Stretches, stretches_of

PLANT: Final = len(NAMES)
COULOMB, EXCESS, DELAY = 2, 3, 4
"""Places among the values of a search; static friction goes by what it exceeds Coulomb's by."""
_RESOLVED: Final = 1e-9
"""Share of a value that a step is at least, or the value would be the same after it."""


class OutputError:
    """The residuals of a series as a function of the plant, its offset and its first rate."""

    def __init__(self, series: Series, lag_s: float, *, begins_moving: bool) -> None:
        self._series = series
        self._cut = lru_cache(maxsize=4)(partial(_cut, series, lag_s))
        """Most of the plants that are tried after one another have one delay."""
        self.begins_moving = begins_moving

    def simulated(self, values: Sequence[float] | Numbers) -> Numbers:
        """The output of a plant, with its offset."""
        series = self._series
        inertia, damping, coulomb, excess, delay_s, offset = values[:6]
        plant = PlantParameters(inertia, damping, coulomb, coulomb + excess, delay_s)
        rate = float(values[6]) if self.begins_moving else 0.0
        position, turning = motion(plant, self._cut(delay_s), rate)
        return offset + (turning if series.quantity == "rate" else position)

    def residuals(self, values: Sequence[float] | Numbers) -> Numbers:
        """Measured less simulated."""
        return self._series.measured - self.simulated(values)

    def jacobian(self, values: Numbers, steps: Numbers, places: Places) -> Numbers:
        """Return the change of the simulated output with these values: central differences."""
        columns = []
        least = np.full(len(values), -np.inf)
        least[:PLANT] = 0.0
        least[0] = 0.5 * values[0]  # without inertia there is no motion
        for place in places:
            low, high = values.copy(), values.copy()
            step = max(steps[place], _RESOLVED * abs(values[place]))
            high[place] += step
            low[place] = max(low[place] - step, least[place])
            change = self.simulated(high) - self.simulated(low)
            columns.append(change / (high[place] - low[place]))
        return np.column_stack(columns)


def _cut(series: Series, lag_s: float, delay_s: float) -> Stretches:
    return stretches_of(series.given_at, series.given, series.at, delay_s, lag_s)


STEP: Final = 1e-4
"""Step of a difference, in scales."""
CLOSE: Final = 1e-6
"""Relative change of the sum of squares below which a search has ended."""
ROUGH: Final = 1e-3
"""The same of one that another follows."""
_LEAST_INERTIA: Final = 1e-3
_TRIALS: Final = 60


@dataclass(frozen=True, slots=True)
class Search:
    """A model, and what makes a difference in each of its values, in their units."""

    model: OutputError
    scale: Numbers

    def solved(
        self, noise: Noise, begin: Numbers, *, held: int | None = None, ends: float = CLOSE
    ) -> Numbers:
        """The values of the least sum of squares, none of the plant's below 0; one may be held."""
        low, high = _bounds(begin)
        begin = np.clip(begin, low, high)
        free = np.array([place for place in range(len(begin)) if place != held])

        def whole(at: Numbers) -> Numbers:
            values = begin.copy()
            values[free] = at
            return values

        def residuals(at: Numbers) -> Numbers:
            return noise.whitened(self.model.residuals(whole(at)))

        def jacobian(at: Numbers) -> Numbers:
            return -noise.whitened(self.model.jacobian(whole(at), STEP * self.scale, free))

        solution = least_squares(
            residuals,
            begin[free],
            jacobian,
            bounds=(low[free], high[free]),
            x_scale=self.scale[free],
            xtol=1e-7,
            ftol=ends,
            gtol=1e-10,
            max_nfev=_TRIALS,
        )
        return whole(solution.x)

    def within(self, values: Numbers, begin: Numbers) -> Numbers:
        """The values, none out of the bounds of a search that begins there."""
        kept: Numbers = np.clip(values, *_bounds(begin))
        return kept

    def squares(self, noise: Noise, values: Numbers) -> float:
        """The sum of the whitened residuals' squares."""
        return float(np.sum(noise.whitened(self.model.residuals(values)) ** 2))

    def sensitivity(self, noise: Noise, values: Numbers, steps: Numbers, places: Places) -> Numbers:
        """Return the change of the whitened output with these values, a scale each."""
        changes = self.model.jacobian(values, steps, places)
        sensitivity: Numbers = noise.whitened(changes) * self.scale[places]
        return sensitivity


def _bounds(begin: Numbers) -> tuple[Numbers, Numbers]:
    low, high = np.full(len(begin), -np.inf), np.full(len(begin), np.inf)
    low[:PLANT], high[DELAY] = 0.0, MOST_DELAY_S
    low[0] = _LEAST_INERTIA * begin[0]
    return low, high
