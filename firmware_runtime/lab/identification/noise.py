"""Noise whose values depend on those before: an autoregression, and what it leaves white.

Measurements that follow each other closely share their noise, so each says less than one of white
noise would; intervals that do not allow for it are too narrow.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from firmware_runtime.lab.identification.plant import Numbers

MOST: Final = 8


@dataclass(frozen=True, slots=True)
class Noise:
    """`value[k] = sum of weights[i] value[k-1-i] + white`; no weights for white noise."""

    weights: Numbers

    def whitened(self, values: Numbers) -> Numbers:
        """Return what those before do not foretell; shorter by as many as there are weights.

        Along the first axis, so that the columns of a matrix are each whitened.
        """
        order = len(self.weights)
        white = values[order:].copy()
        for back in np.flatnonzero(self.weights) + 1:
            white -= self.weights[back - 1] * values[order - back : len(values) - back]
        return white

    @property
    def memory(self) -> float:
        """Over how many measurements a value is remembered; infinite for a random walk."""
        forgotten = 1.0 - float(np.sum(self.weights))
        return 1.0 / forgotten if forgotten > 0.0 else np.inf


WHITE: Final = Noise(np.empty(0))


def random_walk(span: int) -> Noise:
    """Noise that whitens to the change over so many measurements; over 0 to the value."""
    weights = np.zeros(span)
    weights[-1:] = 1.0
    return Noise(weights)


def noise_of(residuals: Numbers) -> Noise:
    """The autoregression of residuals, of the order with the least Bayesian information criterion.

    The weights are those of least squares, which has no bias towards zero from the ends as the
    equations of Yule and Walker have.
    """
    judged = [_fitted(residuals, order) for order in range(MOST + 1)]
    return min(judged, key=lambda each: each[1])[0]


def _fitted(residuals: Numbers, order: int) -> tuple[Noise, float]:
    after = residuals[MOST:]
    count = len(after)
    weights: Numbers = np.empty(0)
    if order:
        before = [residuals[MOST - back : len(residuals) - back] for back in range(1, order + 1)]
        weights, *_ = np.linalg.lstsq(np.column_stack(before), after, rcond=None)
        after = after - np.column_stack(before) @ weights
    variance = float(np.mean(after**2)) or np.finfo(float).tiny
    return Noise(weights), count * np.log(variance) + order * np.log(count)
