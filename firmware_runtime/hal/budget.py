"""Bus budget: what a transaction costs on the wire, and whether a bus can carry a board.

A byte takes nine bits (eight and the acknowledge), an address byte stands before every message, and
START, each repeated START and STOP take one bit each. What an adapter and its driver take beside
that, once a transaction, can be stated (`overhead_ns`); clock stretching is not in it, so the true
time is never shorter. Everything that asks for this time goes by `wire_ns` and `transaction_ns`:
the budget, the counters of a bus, the doubles, and the waits of drivers.

Lines are in time, too. A model lives at the instants of its events; within one, each transaction
takes its time on the wire, and the lines run ahead of the model by it. A device that needs time
needs it from the end of the transaction, so a phase that waits for it is longer by what the lines
have run ahead (`elapsed`). `firmware_drivers.hardware.HardwareModel.hold_after_transfer` adds that.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final, Protocol

from msgspec import Struct

from firmware_runtime.hal.i2c import Message


class LineTime(Protocol):
    """The time in which all lines of one robot live; call it for the instant they have come to."""

    def __call__(self) -> int:
        """Return the instant, in ns since the start of the run; it never goes back."""

    def reach(self, at: int) -> None:
        """Go on to `at`, where a transaction ended; nothing happens if that is past already."""

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way to where the lines are now."""


class Line(Protocol):
    """A bus or a port, as far as waiting for what is connected to it goes."""

    name: str

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way to the end of the last transfer."""


class _NoTime:
    """A line outside of any run: nothing takes time."""

    def __call__(self) -> int:
        return 0

    def reach(self, at: int) -> None:
        """Stay where it is."""

    def elapsed(self) -> int:
        return 0


NO_TIME: Final = _NoTime()


class WireClock(Protocol):
    """A clock for a whole rig: transactions on its buses take their time on it."""

    def __call__(self) -> int:
        """Return the present instant, in ns."""

    def reach(self, at: int) -> None:
        """Go on to `at`, unless that is past."""


NANOSECONDS_PER_SECOND: Final = 1_000_000_000
REFUSED_ABOVE_PERCENT: Final = 80
WARNED_ABOVE_PERCENT: Final = 50


def wire_bytes(messages: Sequence[Message]) -> int:
    """Bytes of one transaction, the address byte of every message included."""
    total = len(messages)
    for message in messages:
        total += message if isinstance(message, int) else len(message)
    return total


def framed_bits(byte_count: int, message_count: int) -> int:
    """Bit times of so many bytes: nine each, one for each START, repeated START and STOP."""
    return 9 * byte_count + message_count + 1


def bits(messages: Sequence[Message]) -> int:
    """Bit times of one transaction."""
    return framed_bits(wire_bytes(messages), len(messages))


@lru_cache(maxsize=1024)
def wire_ns(bit_count: int, bus_hz: int) -> int:
    """Nanoseconds that many bits take on a bus of that speed, rounded up.

    Kept for the few lengths that a run has, over and over.
    """
    return -(-bit_count * NANOSECONDS_PER_SECOND // bus_hz)


@lru_cache(maxsize=1024)
def framed_ns(byte_count: int, message_count: int, bus_hz: int) -> int:
    """Nanoseconds that a transaction of so many bytes takes on a bus of that speed."""
    return wire_ns(framed_bits(byte_count, message_count), bus_hz)


def transaction_ns(messages: Sequence[Message], bus_hz: int, overhead_ns: int = 0) -> int:
    """Nanoseconds one transaction holds a bus of that speed and its adapter."""
    return overhead_ns + wire_ns(bits(messages), bus_hz)


class PeriodicTransaction(Struct, frozen=True):
    """A transaction a board repeats for as long as it runs; `what` names it for people."""

    what: str
    messages: tuple[Message, ...]
    period_ns: int


class BusLoad:
    """The share of one bus that a board's periodic transactions take.

    More than 80 % is refused: nothing is left for retries. More than 50 % is warned of.
    """

    def __init__(
        self,
        name: str,
        bus_hz: int,
        transactions: Sequence[PeriodicTransaction],
        overhead_ns: int = 0,
    ) -> None:
        self.name = name
        self.bus_hz = bus_hz
        self.overhead_ns = overhead_ns
        self.transactions = tuple(transactions)
        # Over the common period every transaction happens a whole number of times: exact integers.
        self._common_ns = math.lcm(*(each.period_ns for each in self.transactions))
        self._busy_ns = sum(map(self._busy_in_common, self.transactions))

    @property
    def utilisation(self) -> float:
        """Busy time over time, 0 for an idle bus; above 1 the bus cannot carry it at all."""
        return self._busy_ns / self._common_ns

    def fault(self) -> str | None:
        """Return the sentence that refuses this load, or None."""
        if not self._exceeds(REFUSED_ABOVE_PERCENT):
            return None
        return self._sentence(f"above {REFUSED_ABOVE_PERCENT} % is refused")

    def warning(self) -> str | None:
        """Return the sentence that warns of this load, or None; a refused one is not warned of."""
        if self._exceeds(REFUSED_ABOVE_PERCENT) or not self._exceeds(WARNED_ABOVE_PERCENT):
            return None
        return self._sentence(f"above {WARNED_ABOVE_PERCENT} % little is left for retries")

    def _busy_in_common(self, each: PeriodicTransaction) -> int:
        once = transaction_ns(each.messages, self.bus_hz, self.overhead_ns)
        return once * (self._common_ns // each.period_ns)

    def _exceeds(self, percent: int) -> bool:
        return 100 * self._busy_ns > percent * self._common_ns

    def _sentence(self, verdict: str) -> str:
        shares = ", ".join(
            f"{each.what} {self._busy_in_common(each) / self._common_ns:.1%}"
            for each in self.transactions
        )
        return (
            f"{self.name}: {self.utilisation:.1%} of its time at {self.bus_hz} Hz is needed, "
            f"{verdict} ({shares})"
        )
