"""The plant whose simulated output lies closest to the measured one, and how sure that is.

The residuals are whitened by the noise's own autoregression, fitted in turns with the plant. What a
position is off by is all that went wrong before, so a search from afar would end where it is not
best: positions are first compared over short spans, then over longer ones, last as they are.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from firmware_runtime.lab.identification.noise import WHITE, Noise, noise_of, random_walk
from firmware_runtime.lab.identification.plant import Numbers, PlantParameters
from firmware_runtime.lab.identification.profile import Intervals, Profile
from firmware_runtime.lab.identification.recorded_series import Series
from firmware_runtime.lab.identification.regression import Guess, guesses
from firmware_runtime.lab.identification.search import (
    COULOMB,
    EXCESS,
    PLANT,
    ROUGH,
    OutputError,
    Search,
)

_STATICS: Final = 12
_MOST_STATIC: Final = 2.0
_COMPARED: Final = 50
"""Starts from positions are compared by how far the body moved in a 50th of the recording."""


@dataclass(frozen=True, slots=True)
class Start:
    """Values to begin from, how badly they fit, and the guess that they are of."""

    values: Numbers
    misfit: float
    guess: Guess


def starts(model: OutputError, series: Series, guesses: list[Guess]) -> list[Start]:
    """The best of each guess over a grid of static frictions, the best of all first."""
    noise = compared_by(series)
    found = (
        min(_tried(model, series, noise, guess), key=lambda each: each.misfit) for guess in guesses
    )
    return sorted(found, key=lambda each: each.misfit)


def compared_by(series: Series) -> Noise:
    """A position's error grows with all that was wrong before, so changes of it are compared."""
    if series.quantity == "rate":
        return random_walk(0)
    return random_walk(max(1, len(series.at) // _COMPARED))


def _tried(model: OutputError, series: Series, noise: Noise, guess: Guess) -> Iterator[Start]:
    first = _first(series, guess, begins_moving=model.begins_moving)
    search = Search(model, np.ones(len(first)))
    grid = np.linspace(0.0, _MOST_STATIC * guess.plant.static, _STATICS)
    for excess in [first[EXCESS], *grid]:
        values = first.copy()
        values[EXCESS] = excess
        yield Start(values, search.squares(noise, values), guess)


def _first(series: Series, guess: Guess, *, begins_moving: bool) -> Numbers:
    plant = guess.plant
    offset = guess.rest if series.quantity == "rate" else float(series.measured[0])
    first = [plant.inertia, plant.damping, plant.coulomb, plant.static - plant.coulomb]
    more = [_first_rate(series) - guess.rest] if begins_moving else []
    return np.array([*first, plant.delay_s, offset, *more])


def scales(series: Series, start: Start) -> Numbers:
    """Return the change that makes a difference, in the unit of each value."""
    pushed, spread = float(np.std(series.given)), float(np.std(series.measured))
    inertia = start.guess.plant.inertia
    found = [inertia, inertia, 0.1 * pushed, 0.1 * pushed, 0.01, spread]
    return np.array([*found, *[spread for _ in start.values[len(found) :]]])


def begins_moving(series: Series) -> bool:
    """Return whether the body moves already at the first measurement: far beyond the noise."""
    noise = float(np.median(np.abs(np.diff(series.measured, 2)))) / 0.6745 / np.sqrt(6.0)
    if series.quantity == "position":
        moved = float(series.measured[8] - series.measured[0])
        return bool(abs(moved) > 8.0 * noise)
    return bool(abs(_first_rate(series)) > max(8.0 * noise, 0.05 * np.ptp(series.measured)))


def _first_rate(series: Series) -> float:
    if series.quantity == "rate":
        return float(np.mean(series.measured[:3]))
    return float((series.measured[8] - series.measured[0]) / (series.at[8] - series.at[0]))


_ROUNDS: Final = 2
_STARTS: Final = 3
_WALKS: Final = 6
"""Most walks over static friction: each but the last found values that fit better."""
_SPANS: Final = (64, 16, 4)
"""Parts of the recording over which a change of position is compared, one after another."""
_LONG: Final = 10.0
_LONG_S: Final = 0.2


@dataclass(frozen=True, slots=True)
class Fit:
    """Values in the order inertia, damping, coulomb, static, delay; then the rest.

    The rest is an offset of the output and, for a body that moved at the first measurement, its
    rate there.
    """

    values: Numbers
    intervals: Intervals
    """Intervals of the five."""
    residuals: Numbers
    noise: Noise
    settled: bool
    """True if the last walk over static friction found nothing that fits better."""
    wanders: bool
    """True if the residuals are remembered for longer than noise is."""
    guess: Guess

    @property
    def plant(self) -> PlantParameters:
        """The best."""
        return PlantParameters(*map(float, self.values[:PLANT]))


@dataclass(frozen=True, slots=True)
class _Found:
    """End of a search."""

    search: Search
    start: Start
    noise: Noise
    values: Numbers
    residuals: Numbers


def fit(series: Series, lag_s: float, confidence: float) -> Fit:
    """The plant with the least whitened residuals; `lag_s` is known."""
    model = OutputError(series, lag_s, begins_moving=begins_moving(series))
    found = _best(model, series, starts(model, series, guesses(series, lag_s)))
    for _ in range(_WALKS):
        profile = Profile(found.search, found.noise, found.values, confidence)
        better = profile.run()
        if better is None:
            break
        found = _in_turns(found.search, found.start, better)
    values = found.values.copy()
    values[EXCESS] += values[COULOMB]
    return Fit(
        values,
        profile.intervals,
        found.residuals,
        found.noise,
        better is None,
        _wanders(found.noise, series),
        found.start.guess,
    )


def _best(model: OutputError, series: Series, begun: list[Start]) -> _Found:
    """The first start's, unless what it leaves is no noise: then the best of some."""
    found: list[_Found] = []
    for start in begun[:_STARTS]:
        found.append(_searched(model, series, start))
        if not _wanders(found[-1].noise, series):
            break
    return min(found, key=lambda each: float(np.sum(each.residuals**2)))


def _searched(model: OutputError, series: Series, start: Start) -> _Found:
    search = Search(model, scales(series, start))
    values = start.values
    if series.quantity == "position":
        for parts in _SPANS:
            walk = random_walk(max(1, len(series.at) // parts))
            values = search.solved(walk, values, ends=ROUGH)
    values = search.solved(WHITE, values, ends=ROUGH)
    return _in_turns(search, start, values)


def _in_turns(search: Search, start: Start, values: Numbers) -> _Found:
    """Noise of what the plant leaves, plant of what the noise leaves white."""
    for _ in range(_ROUNDS):
        noise = noise_of(search.model.residuals(values))
        values = search.solved(noise, values)
    return _Found(search, start, noise, values, search.model.residuals(values))


def _wanders(noise: Noise, series: Series) -> bool:
    """Return whether noise is remembered over many measurements and for long."""
    period = float(np.median(np.diff(series.at)))
    return noise.memory > max(_LONG, _LONG_S / period)
