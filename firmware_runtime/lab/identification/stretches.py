"""The time of a recording cut where the input changes, and the drive that comes of it.

Between two nodes the input is constant, so drive, rate and position are sums of exponentials: their
values at the nodes are exact, however far apart the nodes are.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import exprel

from firmware_runtime.lab.identification.plant import Numbers, Places

_SHALLOW = 1e-3


def convolutions(a: float, b: float, spans: Numbers) -> Numbers:
    """The integral of e^(-a (t - u)) e^(-b u) over u from 0 to each t; a, b >= 0, equal or not."""
    found: Numbers = spans * exprel(-abs(a - b) * spans) * np.exp(-min(a, b) * spans)
    return found


def ramps(a: float, spans: Numbers) -> Numbers:
    """The integral of (1 - e^(-a u)) / a over u from 0 to each t; t^2 / 2 where a is 0."""
    z = a * spans
    series = spans * spans * (1 / 2 - z * (1 / 6 - z * (1 / 24 - z / 120)))
    if not a:
        return series
    return np.where(z < _SHALLOW, series, (spans + np.expm1(-z) / a) / a)


def convolution(a: float, b: float, span: float) -> float:
    """The same as `convolutions` over one span."""
    apart = abs(a - b) * span
    mean = -math.expm1(-apart) / apart if apart else 1.0
    return span * mean * math.exp(-min(a, b) * span)


def ramp(a: float, span: float) -> float:
    """The same as `ramps` over one span."""
    z = a * span
    if z < _SHALLOW:
        return span * span * (1 / 2 - z * (1 / 6 - z * (1 / 24 - z / 120)))
    return (span + math.expm1(-z) / a) / a


_DEEPEST: Final = 30.0
"""Exponent up to which a running product is kept in one piece: e^30 leaves a float its digits."""
_LONGEST: Final = 256


@dataclass(frozen=True, slots=True)
class Stretches:
    """Stretch k is from node k to k + 1, s; the `given` input is constant in it."""

    spans: Numbers
    given: Numbers
    drive: Numbers
    """At the nodes: the input after the actuator's lag."""
    lag_s: float
    begin: int
    """The node of the first measurement, where the motion begins."""
    measured: Places
    """The nodes of the measurements."""


def stretches_of(
    given_at: Numbers, given: Numbers, measured_at: Numbers, delay_s: float, lag_s: float
) -> Stretches:
    """Cut the time up to the last measurement.

    Before its first instant there was no input, and no drive.
    """
    changes = given_at + delay_s
    at = np.unique(np.concatenate((measured_at, changes[changes < measured_at[-1]])))
    which = np.searchsorted(changes, at[:-1], side="right") - 1
    held = np.where(which < 0, 0.0, given[np.maximum(which, 0)])
    spans = np.diff(at)
    drive = np.append(held, held[-1])
    if lag_s:
        drive = follow(0.0, spans / lag_s, -held * np.expm1(-spans / lag_s))
    measured = np.searchsorted(at, measured_at)
    return Stretches(spans, held, drive, lag_s, int(measured[0]), measured)


def follow(first: float, decays: Numbers, gains: Numbers) -> Numbers:
    """Every z of `z[k+1] = exp(-decays[k]) z[k] + gains[k]`, the first included."""
    values = np.empty(len(gains) + 1)
    values[0] = first
    for begin, end in pieces(decays):
        values[begin + 1 : end + 1] = followed(values[begin], decays[begin:end], gains[begin:end])
    return values


def followed(first: float, decays: Numbers, gains: Numbers) -> Numbers:
    """The same without the first, for one piece; one alone may decay as deep as it likes."""
    if len(decays) == 1:
        alone: Numbers = np.exp(-decays) * first + gains
        return alone
    faded = np.exp(-np.cumsum(decays))
    return faded * (first + np.cumsum(gains / faded))


def pieces(decays: Numbers, begin: int = 0) -> Iterator[tuple[int, int]]:
    """Pieces of what is left from `begin` on, none of which decays too deep for a float."""
    while begin < len(decays):
        depth = np.cumsum(decays[begin : begin + _LONGEST])
        length = max(1, int(np.searchsorted(depth, _DEEPEST)))
        yield begin, begin + length
        begin += length
