"""The sockets beside a run's statistics, by which other processes reach it.

What a socket takes is imported where there is one: virtual time, which nothing reaches, starts
without.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_runtime.executive.clocks import Clock, MonotonicClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.runs.arming import Arming
from firmware_runtime.runs.tuning import Tuning
from firmware_runtime.statistics.companions import Companion

if TYPE_CHECKING:
    from firmware_runtime.links.ports.ports import Ports
    from firmware_runtime.links.ports.ports_socket import PortsSocket
    from firmware_runtime.runs.requests import Requests


def has_ports(statistics: Path | None, clock: Clock) -> bool:
    """Whether others put values in and watch: in real time, where they can find the run."""
    return statistics is not None and isinstance(clock, MonotonicClock)


def serve_ports(
    statistics: Path | None, ports: "Ports | None", executive: Executive
) -> "PortsSocket | None":
    """Let other processes put values in and watch, if the run has ports for them."""
    if statistics is None or ports is None:
        return None
    from firmware_runtime.links.ports.ports_socket import PortsSocket  # noqa: PLC0415

    return PortsSocket(Companion.PORTS.beside(statistics), ports, executive)


def take_requests(
    statistics: Path | None,
    executive: Executive,
    arming: Arming | None,
    tuning: Tuning,
    log: Callable[[str], None],
) -> "Requests | None":
    """Let other processes arm it, disarm it and change its gains, if they can find it."""
    if statistics is None:
        return None
    from firmware_runtime.runs.requests import Requests  # noqa: PLC0415

    return Requests(Companion.CONTROL.beside(statistics), executive, arming, tuning, log)
