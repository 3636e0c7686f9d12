"""Identified numbers, each with its 95 % interval, and warnings beside them."""

from collections.abc import Iterator
from typing import Final

import numpy as np
from msgspec import Struct, to_builtins

from firmware_runtime.lab.identification.fit import Fit, fit
from firmware_runtime.lab.identification.plant import KEYS, NAMES, PlantParameters, Structure
from firmware_runtime.lab.identification.recorded_series import Series

CONFIDENCE: Final = 0.95
_WIDE: Final = 1.0
"""An interval as wide as its value says little of it."""


class Estimate(Struct, frozen=True):
    """One number; an end of its interval is None where nothing in the run bounds it."""

    value: float
    low: float | None
    high: float | None
    regression: float
    """The same by linear least squares, from which the search began."""

    def holds(self, truth: float) -> bool:
        """Return whether a number lies in the interval."""
        return (self.low is None or self.low <= truth) and (self.high is None or truth <= self.high)


class Identified(Struct, frozen=True):
    """The plant of one recording, SI; the lag was known before."""

    structure: Structure
    parameters: dict[str, Estimate]
    """By key: `inertia_kg_m2` or `mass_kg`, and so on."""
    lag_s: float
    offset: float
    """Offset of the measured output: a sensor's bias, or where the body was."""
    measurements: int
    seconds: float
    noise: float
    """Standard deviation of what no earlier noise foretells."""
    noise_weights: list[float]
    """On the noise one, two, ... measurements before; none for white noise."""
    explained: float
    """Share of the output's variance that the plant explains, 0 to 1."""
    warnings: list[str]

    @property
    def plant(self) -> PlantParameters:
        """The best."""
        return PlantParameters(*(each.value for each in self.parameters.values()))


def identify(series: Series, structure: Structure, lag_s: float) -> tuple[Identified, Fit]:
    """The plant that a series shows, and the fit that it was read from."""
    found = fit(series, lag_s, CONFIDENCE)
    estimates = dict(zip(KEYS[structure], _estimates(found), strict=True))
    white = found.noise.whitened(found.residuals)
    explained = float(1.0 - np.var(found.residuals) / np.var(series.measured))
    identified = Identified(
        structure=structure,
        parameters=estimates,
        lag_s=lag_s,
        offset=float(found.values[len(NAMES)]),
        measurements=len(series.at),
        seconds=float(series.at[-1] - series.at[0]),
        noise=float(np.std(white)),
        noise_weights=found.noise.weights.tolist(),
        explained=explained,
        warnings=list(_warnings(estimates, explained, found)),
    )
    return identified, found


def _estimates(found: Fit) -> Iterator[Estimate]:
    ends = zip(found.intervals.low.tolist(), found.intervals.high.tolist(), strict=True)
    guessed = found.guess.plant.values
    for value, (low, high), first in zip(found.plant.values, ends, guessed, strict=True):
        yield Estimate(value, max(low, 0.0), high if np.isfinite(high) else None, first)


def _warnings(estimates: dict[str, Estimate], explained: float, found: Fit) -> Iterator[str]:
    for key, each in estimates.items():
        if each.high is None:
            yield f"{key}: nothing in the run bounds it; expected a body that stands still"
        elif each.value > 0.0 and each.high - (each.low or 0.0) > 2 * _WIDE * each.value:
            yield f"{key}: hardly to be seen in this run, its interval is wider than itself"
    if not found.settled:
        yield "the search ended before nothing fitted better; its intervals are not to be trusted"
    if found.wanders:
        yield "what the plant leaves is no noise: it is remembered for long; look at the difference"
    if explained < 0.9:
        yield f"the plant explains {explained:.0%} of the output's variance; expected 90 % or more"


def as_json(identified: Identified) -> dict[str, object]:
    """The numbers for a program."""
    found: dict[str, object] = to_builtins(identified)
    noise = {"deviation": found.pop("noise"), "weights": found.pop("noise_weights")}
    return {**found, "confidence": CONFIDENCE, "noise": noise}
