"""A first guess by linear least squares on integrals: no derivative of anything noisy is taken.

Integrated once, the equation of motion is linear in what is unknown:

    rate = offset + (1/inertia) integral(drive) - (damping/inertia) integral(rate)
           - (coulomb/inertia) integral(sign of rate)

with the integrals taken while the body moves. Integrating averages noise out of the regressors; of
a measured position it is the slope over a span that is taken for the rate. The delay is the one of
a grid that fits best.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import uniform_filter1d
from scipy.signal import savgol_filter

from firmware_runtime.lab.identification.plant import Numbers, PlantParameters
from firmware_runtime.lab.identification.recorded_series import Series
from firmware_runtime.lab.identification.stretches import Stretches, stretches_of

Cut: TypeAlias = tuple[float, Stretches]
"""A delay, s, and the time of the recording cut where the input changes after it."""

MOST_DELAY_S: Final = 0.5
_DELAYS: Final = 51
_SMOOTHED: Final = 9
_FEWEST_SPANS: Final = 15
_STANDING: Final = 4.0
"""So many deviations of the smoothed noise, and a rate is one."""
_LEAST_PUSH: Final = 1e-6
"""Share of what was measured that the input has to make, or there is no plant in the run."""


@dataclass(frozen=True, slots=True)
class Guess:
    """The plant, and how far from it the measurements lie, root mean square."""

    plant: PlantParameters
    misfit: float
    rest: float = 0.0
    """Reading of a sensor of rates at rest."""


def guesses(series: Series, lag_s: float) -> list[Guess]:
    """The plant whose integrals fit best; of positions one for each span that they are sloped over.

    A short span leaves noise in the slopes, a long one blurs the motion.
    """
    delays = np.linspace(0.0, MOST_DELAY_S, _DELAYS)
    cuts = [
        (float(delay_s), stretches_of(series.given_at, series.given, series.at, delay_s, lag_s))
        for delay_s in delays
    ]
    if series.quantity == "rate":
        return [_guess(series, cuts)]
    return [_guess(rates_of(series, span), cuts) for span in _spans(series)]


def _spans(series: Series) -> Iterator[int]:
    """Numbers of measurements, odd, each about twice the one before."""
    span = _SMOOTHED
    while span < len(series.at) // _FEWEST_SPANS:
        yield span
        span = 2 * span - 1


def rates_of(series: Series, span: int) -> Series:
    """The rate instead of the position: slopes of parabolas over so many measurements."""
    period = float(np.median(np.diff(series.at)))
    even = np.arange(series.at[0], series.at[-1] + 0.5 * period, period)
    measured = np.interp(even, series.at, series.measured)
    slopes = savgol_filter(measured, span, 2, deriv=1, delta=period)
    return replace(series, measured=np.interp(series.at, even, slopes), quantity="rate")


def _guess(series: Series, cuts: Sequence[Cut]) -> Guess:
    """The sensor reads 0 at rest, or what it reads at first."""
    rate = uniform_filter1d(series.measured, _SMOOTHED, mode="nearest")
    still = _still(rate, series)
    found = (
        _at_rest(series, cuts, rate - rest, still, rest)
        for rest in (0.0, float(np.median(rate[:_SMOOTHED])))
    )
    return min(found, key=lambda each: each.misfit)


def _at_rest(
    series: Series, cuts: Sequence[Cut], rate: Numbers, still: float, rest: float
) -> Guess:
    """The best of a grid of delays, where this is what the sensor reads at rest."""
    moving: Numbers = (np.abs(rate) > still).astype(np.float64)
    resisting = [
        -cumulative_trapezoid(moving * rate, series.at, initial=0),
        -cumulative_trapezoid(moving * np.sign(rate), series.at, initial=0),
    ]
    found = (_at_delay(series, moving, resisting, *each) for each in cuts)
    return replace(min(found, key=lambda each: each.misfit), rest=rest)


def _at_delay(
    series: Series, moving: Numbers, resisting: Sequence[Numbers], delay_s: float, cut: Stretches
) -> Guess:
    drive = cut.drive[cut.measured]
    at = series.at
    columns = [cumulative_trapezoid(moving * drive, at, initial=0), *resisting]
    matrix = np.column_stack([np.ones_like(at), *columns])
    found, *_ = np.linalg.lstsq(matrix, series.measured, rcond=None)
    misfit = float(np.sqrt(np.mean((series.measured - matrix @ found) ** 2)))
    if not found[1] * np.ptp(columns[0]) > _LEAST_PUSH * np.std(series.measured):
        return Guess(_no_plant(series), np.inf)
    inertia = 1.0 / found[1]
    coulomb = max(float(found[3] * inertia), 0.0)
    static = max(_breakaway(np.abs(drive), moving), coulomb)
    damping = max(float(found[2] * inertia), 0.0)
    return Guess(PlantParameters(float(inertia), damping, coulomb, static, delay_s), misfit)


def _no_plant(series: Series) -> PlantParameters:
    """A body that a second of the input moves about as far as was measured."""
    pushed, moved = float(np.std(series.given)), float(np.std(series.measured))
    return PlantParameters(pushed / (moved or 1.0), 0.0, 0.0, 0.0, 0.0)


def _breakaway(drive: Numbers, moving: Numbers) -> float:
    """The median drive at which the body began to move; the largest that it withstood if none."""
    began = np.flatnonzero(np.diff(moving) > 0)
    if len(began):
        return float(np.median(drive[began]))
    standing = drive[moving == 0.0]
    return float(standing.max()) if len(standing) else 0.0


def _still(rate: Numbers, series: Series) -> float:
    """The rate that is none beside the noise, or beside the rates that there are."""
    noise = np.median(np.abs(np.diff(series.measured, 2))) / 0.6745 / np.sqrt(6.0)
    return float(max(_STANDING * noise / np.sqrt(_SMOOTHED), 0.01 * np.std(rate)))
