"""The search for the values with the least squares of whitened residuals: scipy's, in bounds."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import least_squares

from firmware_runtime.lab.identification.noise import Noise
from firmware_runtime.lab.identification.output_error import DELAY, PLANT, OutputError
from firmware_runtime.lab.identification.plant import Numbers, Places
from firmware_runtime.lab.identification.regression import MOST_DELAY_S

STEP: Final = 1e-4
"""Of a difference, in scales."""
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
        """How the whitened output changes with the values at these places, one scale each."""
        changes = self.model.jacobian(values, steps, places)
        sensitivity: Numbers = noise.whitened(changes) * self.scale[places]
        return sensitivity


def _bounds(begin: Numbers) -> tuple[Numbers, Numbers]:
    low, high = np.full(len(begin), -np.inf), np.full(len(begin), np.inf)
    low[:PLANT], high[DELAY] = 0.0, MOST_DELAY_S
    low[0] = _LEAST_INERTIA * begin[0]
    return low, high
