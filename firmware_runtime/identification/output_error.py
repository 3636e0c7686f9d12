"""The plant whose simulated output lies closest to the measured one, and how sure that is.

Simulated from the input alone, so that noise in the output does not pass for motion. The residuals
are whitened by the noise's own autoregression, fitted in turns with the plant.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Final

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import chi2

from firmware_runtime.identification.motion import motion
from firmware_runtime.identification.noise import WHITE, Noise, noise_of
from firmware_runtime.identification.plant import Numbers, PlantParameters
from firmware_runtime.identification.regression import MOST_DELAY_S, Guess
from firmware_runtime.identification.series import Series
from firmware_runtime.identification.stretches import Stretches, stretches_of

_ROUNDS: Final = 2
_STATICS: Final = 12
_STEP: Final = 1e-4
_PLANT: Final = 5
_COULOMB, _STATIC, _DELAY = 2, 3, 4
_NO_DIFFERENCE: Final = 1e-3
"""A value whose whole scale moves the output by less of the noise than this is not seen in it."""
_HALVINGS: Final = 12
_DOUBLINGS: Final = 6


@dataclass(frozen=True, slots=True)
class Fit:
    """Values and their covariance in the order inertia, damping, coulomb, static, delay; the rest.

    The rest is an offset of the output and, for a body that moved at the first measurement, its
    rate there.
    """

    values: Numbers
    covariance: Numbers
    residuals: Numbers
    noise: Noise
    deviation: float
    """Of the whitened residuals."""
    freedom: int
    """Whitened residuals less what was estimated of them."""
    static_range: tuple[float, float]
    """The static friction that fits as well, all else as it is."""

    @property
    def plant(self) -> PlantParameters:
        """The best."""
        return PlantParameters(*map(float, self.values[:_PLANT]))


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

    def jacobian(self, values: Numbers, steps: Numbers) -> Numbers:
        """How the simulated output changes, by central differences of these steps."""
        columns = []
        least = np.full(len(values), -np.inf)
        least[:_PLANT] = 0.0
        least[0] = 0.5 * values[0]  # without inertia there is no motion
        for place, step in enumerate(steps):
            low, high = values.copy(), values.copy()
            high[place] += step
            low[place] = max(low[place] - step, least[place])
            change = self.simulated(high) - self.simulated(low)
            columns.append(change / (high[place] - low[place]))
        return np.column_stack(columns)


def _cut(series: Series, lag_s: float, delay_s: float) -> Stretches:
    return stretches_of(series.given_at, series.given, series.at, delay_s, lag_s)


def fit(series: Series, start: Guess, lag_s: float) -> Fit:
    """The plant with the least whitened residuals, from a start; `lag_s` is known."""
    model = OutputError(series, lag_s, begins_moving=_begins_moving(series))
    scale = _scales(series, start.plant, begins_moving=model.begins_moving)
    values = _best_static(model, _first(series, start, begins_moving=model.begins_moving))
    values = _solved(model, WHITE, values, scale)
    noise = WHITE
    for _ in range(_ROUNDS):
        noise = noise_of(model.residuals(values))
        values = _solved(model, noise, values, scale)
    return _judged(model, noise, values, scale)


def _first(series: Series, start: Guess, *, begins_moving: bool) -> Numbers:
    plant = start.plant
    offset = start.rest if series.quantity == "rate" else float(series.measured[0])
    first = [plant.inertia, plant.damping, plant.coulomb, plant.static - plant.coulomb]
    more = [_first_rate(series) - start.rest] if begins_moving else []
    return np.array([*first, plant.delay_s, offset, *more])


def _scales(series: Series, start: PlantParameters, *, begins_moving: bool) -> Numbers:
    """What makes a difference, in the unit of each value."""
    pushed, spread = float(np.std(series.given)), float(np.std(series.measured))
    scales = [start.inertia, start.inertia, 0.1 * pushed, 0.1 * pushed, 0.01, spread]
    return np.array([*scales, spread] if begins_moving else scales)


def _best_static(model: OutputError, first: Numbers) -> Numbers:
    """The start with that static friction of a grid which fits best."""
    tries = [first]
    for excess in np.linspace(0.0, 2.0 * (first[2] + first[3]), _STATICS):
        changed = first.copy()
        changed[_STATIC] = excess
        tries.append(changed)
    return min(tries, key=lambda each: float(np.sum(model.residuals(each) ** 2)))


def _solved(model: OutputError, noise: Noise, values: Numbers, scale: Numbers) -> Numbers:
    """The values of the least sum of squares, none of the five below 0."""
    low, high = np.full(len(values), -np.inf), np.full(len(values), np.inf)
    low[:_PLANT], high[_DELAY] = 0.0, MOST_DELAY_S
    low[0] = 1e-3 * values[0]

    def residuals(at: Numbers) -> Numbers:
        return noise.whitened(model.residuals(at))

    def jacobian(at: Numbers) -> Numbers:
        return -noise.whitened(model.jacobian(at, _STEP * scale))

    solution = least_squares(
        residuals,
        np.clip(values, low, high),
        jacobian,
        bounds=(low, high),
        x_scale=scale,
        xtol=1e-7,
        ftol=1e-9,
        gtol=1e-10,
        max_nfev=60,
    )
    found: Numbers = solution.x
    return found


def _judged(model: OutputError, noise: Noise, values: Numbers, scale: Numbers) -> Fit:
    """The fit with its covariance, by differences as wide as the values are uncertain."""
    residuals = model.residuals(values)
    white = noise.whitened(residuals)
    freedom = len(white) - len(values) - len(noise.weights)
    deviation = float(np.sqrt(white @ white / freedom))
    steps = _STEP * scale
    for _ in range(2):
        jacobian = noise.whitened(model.jacobian(values, steps))
        covariance = _covariance(jacobian, scale, deviation)
        wide = 0.5 * np.sqrt(np.diag(covariance))
        steps = np.maximum(_STEP * scale, np.where(np.isfinite(wide), wide, 0.0))
    sums = np.eye(len(values))
    sums[_STATIC, _COULOMB] = 1.0  # static is coulomb and what is above it
    return Fit(
        values=sums @ values,
        covariance=_transformed(covariance, sums),
        residuals=residuals,
        noise=noise,
        deviation=deviation,
        freedom=freedom,
        static_range=_static_range(model, noise, values, deviation),
    )


def _covariance(jacobian: Numbers, scale: Numbers, deviation: float) -> Numbers:
    """Of the values; infinite for one that makes no difference to the output."""
    scaled = jacobian * scale
    makes_difference = np.linalg.norm(scaled, axis=0) > _NO_DIFFERENCE * deviation
    kept = np.flatnonzero(makes_difference)
    found = np.zeros((len(scale), len(scale)))
    inverse = np.linalg.pinv(scaled[:, kept].T @ scaled[:, kept]) * deviation**2
    found[np.ix_(kept, kept)] = inverse * np.outer(scale[kept], scale[kept])
    found[~makes_difference, ~makes_difference] = np.inf
    return found


def _transformed(covariance: Numbers, sums: Numbers) -> Numbers:
    unknown = ~np.isfinite(np.diag(covariance))
    known = covariance.copy()
    known[unknown, unknown] = 0.0
    found: Numbers = sums @ known @ sums.T
    found[unknown, unknown] = np.inf
    return found


def _static_range(
    model: OutputError, noise: Noise, values: Numbers, deviation: float
) -> tuple[float, float]:
    """The least and most static friction that fits as well, all else as it is.

    The sum of squares grows no further there than chance lets it in 95 of 100 recordings. The only
    interval for a run in which the body broke away where its input jumped: any friction between
    both levels fits then.
    """
    bound = _squares(model, noise, values) + float(chi2.ppf(0.95, 1)) * deviation**2

    def grown(excess: float) -> bool:
        changed = values.copy()
        changed[_STATIC] = excess
        return _squares(model, noise, changed) > bound

    coulomb, excess = float(values[_COULOMB]), float(values[_STATIC])
    low = 0.0 if not grown(0.0) else _edge(grown, excess, 0.0)
    most = 4.0 * (coulomb + excess)  # the value itself may be anywhere between both levels
    for _ in range(_DOUBLINGS):
        if grown(most):
            return coulomb + low, coulomb + _edge(grown, excess, most)
        most *= 2.0
    return coulomb + low, np.inf


def _squares(model: OutputError, noise: Noise, values: Numbers) -> float:
    return float(np.sum(noise.whitened(model.residuals(values)) ** 2))


def _edge(grown: Callable[[float], bool], inside: float, outside: float) -> float:
    for _ in range(_HALVINGS):
        middle = 0.5 * (inside + outside)
        inside, outside = (inside, middle) if grown(middle) else (middle, outside)
    return inside


def _begins_moving(series: Series) -> bool:
    """Whether the body moves already at the first measurement: far beyond the noise."""
    noise = float(np.median(np.abs(np.diff(series.measured, 2)))) / 0.6745 / np.sqrt(6.0)
    if series.quantity == "position":
        moved = float(series.measured[8] - series.measured[0])
        return bool(abs(moved) > 8.0 * noise)
    return bool(abs(_first_rate(series)) > max(8.0 * noise, 0.05 * _reach(series)))


def _reach(series: Series) -> float:
    return float(np.max(series.measured) - np.min(series.measured))


def _first_rate(series: Series) -> float:
    if series.quantity == "rate":
        return float(np.mean(series.measured[:3]))
    return float((series.measured[8] - series.measured[0]) / (series.at[8] - series.at[0]))
