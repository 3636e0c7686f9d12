"""Series that is identified from: a body's input and its position or rate, over time."""

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

import numpy as np

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.identification.plant import Numbers

Quantity: TypeAlias = Literal["rate", "position"]
LEAST: Final = 200
"""Measurements, below which nothing can be said of five numbers and the noise."""


@dataclass(frozen=True, slots=True)
class Series:
    """The input as it was given, each value held until the next; the output as it was measured.

    Instants in s, ascending; N or N m; m or rad, or those a second.
    """

    given_at: Numbers
    given: Numbers
    at: Numbers
    measured: Numbers
    quantity: Quantity

    def since(self, begin_s: float) -> "Series":
        """Without the measurements before an instant; the input before it still counts."""
        kept = self.at >= begin_s
        return Series(self.given_at, self.given, self.at[kept], self.measured[kept], self.quantity)


def checked(series: Series, where: str) -> Series:
    """The series, if something can be identified from it. Raises ConfigError with every fault."""
    faults = list(_faults(series))
    if faults:
        raise ConfigError(where, faults)
    return series


def _faults(series: Series) -> list[str]:
    found: list[str] = []
    if len(series.at) < LEAST:
        found.append(f"{len(series.at)} measurements; expected {LEAST} or more")
    if not len(series.given):
        found.append("no input; expected the values that the actuators were given")
    every = (series.given_at, series.given, series.at, series.measured)
    if not all(np.isfinite(each).all() for each in every):
        found.append("numbers that are not finite; expected finite ones")
    elif any((np.diff(each) <= 0.0).any() for each in (series.given_at, series.at)):
        found.append("instants that do not ascend; expected each once, in order")
    elif len(series.given) and np.ptp(series.given) == 0.0:
        found.append("an input that never changes; expected one that moves the body to and fro")
    elif len(series.measured) and np.ptp(series.measured) == 0.0:
        found.append("an output that never changes; expected a body that its input moves: armed")
    return found
