"""What is measured: pairs of costs, one of BASE and one of HEAD, close together in time."""

from collections.abc import Generator
from math import log
from typing import Protocol

from msgspec import Struct


class Pair(Struct, frozen=True):
    """The cost of the same work in both versions, ns of processor time."""

    base_ns: int
    head_ns: int

    @property
    def log_ratio(self) -> float:
        """The logarithm of HEAD's cost by BASE's."""
        return log(self.head_ns / self.base_ns)


class Measured(Protocol):
    """A way to measure pairs."""

    unit: str
    """What a cost is of: `1 s of robot time`, `a run of the command`."""

    @property
    def units(self) -> float:
        """How many of that are in one cost."""

    def notes(self) -> list[str]:
        """Where the versions do not do the same work, a sentence each."""

    def pairs(self) -> Generator[Pair, None, None]:
        """Pairs without end, until the iterator is closed. Raises ConfigError."""
