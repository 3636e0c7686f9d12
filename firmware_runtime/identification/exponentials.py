"""Integrals of exponentials over many spans at once; those of one span are in `models.plant`."""

import numpy as np

from firmware_runtime.identification.plant import Numbers

_SHALLOW = 1e-3


def convolutions(a: float, b: float, spans: Numbers) -> Numbers:
    """The integral of e^(-a (t - u)) e^(-b u) over u from 0 to each t; a, b >= 0, equal or not."""
    apart = abs(a - b) * spans
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(apart > 0.0, -np.expm1(-apart) / apart, 1.0)
    found: Numbers = spans * mean * np.exp(-min(a, b) * spans)
    return found


def ramps(a: float, spans: Numbers) -> Numbers:
    """The integral of (1 - e^(-a u)) / a over u from 0 to each t; t^2 / 2 where a is 0."""
    z = a * spans
    series = spans * spans * (1 / 2 - z * (1 / 6 - z * (1 / 24 - z / 120)))
    if not a:
        return series
    return np.where(z < _SHALLOW, series, (spans + np.expm1(-z) / a) / a)
