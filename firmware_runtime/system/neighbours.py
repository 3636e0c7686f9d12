"""How busy the rest of the machine was meanwhile: a timing means little without it.

Source: proc_stat(5); ticks of all processors together.
"""

import os
from collections.abc import Callable, Mapping
from pathlib import Path

BUSY_SHARE, STOLEN_SHARE = 0.1, 0.01
"""Of all processors: other processes, or a host, that take more disturb a measurement."""
USER, NICE, SYSTEM, IDLE, WAITING, IRQ, SOFTIRQ, STEAL = range(8)


def first_line() -> str:
    """The sums over all processors."""
    with Path("/proc/stat").open(encoding="ascii") as lines:
        return lines.readline()


def own_ticks() -> float:
    """Processor time of this process and of the children that have ended, in ticks."""
    return sum(os.times()[:4]) * os.sysconf("SC_CLK_TCK")


class Neighbours:
    """Measures from its construction on."""

    def __init__(
        self, line: Callable[[], str] = first_line, own: Callable[[], float] = own_ticks
    ) -> None:
        self._line, self._own = line, own
        self._ticks, self._own_ticks = self._read(), own()

    def shares(self) -> Mapping[str, float]:
        """Shares of all processors: what other processes took, and what the host withheld."""
        passed = [now - before for now, before in zip(self._read(), self._ticks, strict=True)]
        everything = max(sum(passed), 1)
        busy = everything - passed[IDLE] - passed[WAITING] - passed[STEAL]
        others = max(busy - (self._own() - self._own_ticks), 0)
        return {"processes": others / everything, "host": passed[STEAL] / everything}

    def _read(self) -> list[int]:
        return [int(word) for word in self._line().split()[1:9]]


def busy(shares: Mapping[str, float]) -> list[str]:
    """Others that took enough processor time to disturb, by the shares of `Neighbours`."""
    found = []
    if shares["processes"] > BUSY_SHARE:
        found.append(f"other processes took {shares['processes']:.0%} of the processors")
    if shares["host"] > STOLEN_SHARE:
        found.append(f"the host withheld {shares['host']:.0%} of the processors")
    return found
