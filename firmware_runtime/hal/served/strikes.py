"""Faults of served doubles, for a program: list, make, clear.

    for place in faults_of(path).places:
        print(place.name, *place.kinds)
    strike(path, "freeze", "imu", for_s=1.0)
    clear(path)

Each asks the server at `path` and returns its list of faults as it is then. They raise BusAbsent
where no doubles are served, BusTimeout without an answer in a second, and ConfigError for a fault
that cannot be made there; its sentence says what can.
"""

from pathlib import Path

from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.served.client import Ask
from firmware_runtime.hal.served.connection import Connection
from firmware_runtime.hal.served.packets import (
    ClearFaults,
    FaultList,
    FaultQuestion,
    ListFaults,
    Refused,
)
from firmware_runtime.hal.strike import Strike
from firmware_runtime.hal.wire_errors import BusFault


def faults_of(path: Path) -> FaultList:
    """Return the kinds and places of faults at these doubles, and those that were made."""
    return _asked(path, ListFaults())


def strike(
    path: Path,
    kind: str,
    device: str = "",
    *,
    for_s: float | None = None,
    amount: float | None = None,
) -> FaultList:
    """Make a fault now: `for_s` None until it is cleared, 0 once; see `hal.strike.Strike`."""
    return _asked(path, Strike(kind, device, 0.0, for_s, amount))


def clear(path: Path) -> FaultList:
    """End every fault that was made; what had no supply is in its power-up state."""
    return _asked(path, ClearFaults())


def ask_faults(ask: Ask, asked: FaultQuestion) -> FaultList:
    """Ask over a connection that is open."""
    answered = ask(asked, "doubles")
    match answered:
        case FaultList():
            return answered
        case Refused(reason):
            raise ConfigError.of_one("doubles", reason)
    raise BusFault(f"the doubles answered {answered}", where="doubles", expected="their faults")


def _asked(path: Path, asked: FaultQuestion) -> FaultList:
    connection = Connection(path)
    try:
        return ask_faults(connection.ask, asked)
    finally:
        connection.close()
