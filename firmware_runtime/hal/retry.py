"""Retries of a failed transaction: a bounded number of attempts, never a wait.

Retrying cures what passes by itself: a byte not acknowledged, arbitration lost, an adapter's own
fault. A timeout does not pass: a line is held, and each further attempt would hold the loop for a
whole adapter timeout. So `BusTimeout` is never retried.
"""

from typing import Final

from msgspec import Struct

from firmware_runtime.hal.wire_errors import (
    ArbitrationLost,
    BusFault,
    BusTimeout,
    HalError,
    NoAcknowledge,
)


class RetryPolicy(Struct, frozen=True):
    """At most `attempts` tries of a transaction, the first included, on errors of the kinds `on`.

    Retries follow one another at once; nothing sleeps. A retried read repeats its side effects: a
    status register that clears on reading may have been cleared by the attempt that failed.
    """

    attempts: int = 3
    on: tuple[type[HalError], ...] = (NoAcknowledge, ArbitrationLost, BusFault)

    def __post_init__(self) -> None:
        if self.attempts < 1:
            raise ValueError(f"retry policy: {self.attempts} attempts, expected 1 or more")
        retries_timeouts = issubclass(BusTimeout, self.on)
        if retries_timeouts:
            raise ValueError("retry policy: BusTimeout is never retried, the bus is stuck")


THREE_ATTEMPTS: Final = RetryPolicy(attempts=3)
ONE_ATTEMPT: Final = RetryPolicy(attempts=1)
