"""How far a plant's simulated output lies from the measured one.

Simulated from the input alone, so that noise in the output does not pass for motion.
"""

from collections.abc import Sequence
from functools import lru_cache, partial
from typing import Final

import numpy as np

from firmware_runtime.lab.identification.motion import motion
from firmware_runtime.lab.identification.plant import NAMES, Numbers, Places, PlantParameters
from firmware_runtime.lab.identification.recorded_series import Series
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
        """How the simulated output changes with the values at these places: central differences."""
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
