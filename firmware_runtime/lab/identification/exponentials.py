"""Integrals of exponentials, over one span or over many at once.

By the C library's exponential, which may differ in its last bit from one machine to another;
`models.plant` has those of one span that do not, and take several times as long.
"""

import math

import numpy as np
from scipy.special import exprel

from firmware_runtime.lab.identification.plant import Numbers

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
