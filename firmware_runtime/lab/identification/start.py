"""Where the search begins: the first values, and whether the body moved already."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from firmware_runtime.lab.identification.noise import Noise, random_walk
from firmware_runtime.lab.identification.output_error import EXCESS, OutputError
from firmware_runtime.lab.identification.plant import Numbers
from firmware_runtime.lab.identification.recorded_series import Series
from firmware_runtime.lab.identification.regression import Guess
from firmware_runtime.lab.identification.search import Search

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
    """What makes a difference, in the unit of each value."""
    pushed, spread = float(np.std(series.given)), float(np.std(series.measured))
    inertia = start.guess.plant.inertia
    found = [inertia, inertia, 0.1 * pushed, 0.1 * pushed, 0.01, spread]
    return np.array([*found, *[spread for _ in start.values[len(found) :]]])


def begins_moving(series: Series) -> bool:
    """Whether the body moves already at the first measurement: far beyond the noise."""
    noise = float(np.median(np.abs(np.diff(series.measured, 2)))) / 0.6745 / np.sqrt(6.0)
    if series.quantity == "position":
        moved = float(series.measured[8] - series.measured[0])
        return bool(abs(moved) > 8.0 * noise)
    return bool(abs(_first_rate(series)) > max(8.0 * noise, 0.05 * np.ptp(series.measured)))


def _first_rate(series: Series) -> float:
    if series.quantity == "rate":
        return float(np.mean(series.measured[:3]))
    return float((series.measured[8] - series.measured[0]) / (series.at[8] - series.at[0]))
