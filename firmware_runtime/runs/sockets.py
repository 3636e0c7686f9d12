"""The socket beside a run's statistics, by which other processes reach it.

What it takes is imported where there is one: a run that keeps no statistics starts without.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_runtime.executive.clocks import Clock, MonotonicClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.runs.arming import Arming
from firmware_runtime.runs.tuning import Tuning
from firmware_runtime.statistics.paths import Companion

if TYPE_CHECKING:
    from firmware_runtime.links.ports.ports import Ports
    from firmware_runtime.runs.requests import Requests


def has_ports(statistics: Path | None, clock: Clock) -> bool:
    """Whether others put values in and watch: in real time, where they can find the run."""
    return statistics is not None and isinstance(clock, MonotonicClock)


def serve(  # noqa: PLR0913 -- put together once, by the session
    statistics: Path | None,
    executive: Executive,
    ports: "Ports | None",
    *,
    arming: Arming | None,
    tuning: Tuning,
    log: Callable[[str], None],
) -> "Requests | None":
    """Let other processes speak with a run and its ports, if they can find it."""
    if statistics is None:
        return None
    from firmware_runtime.runs.requests import Requests  # noqa: PLC0415

    path = Companion.SOCKET.beside(statistics)
    return Requests(path, executive, ports, arming=arming, tuning=tuning, log=log)
