"""A bus that counts what it carries and tries again what may pass: the one drivers are given.

It stands between a driver and any other bus, Linux or double, and changes no byte. The executive
reads its counters before and after a step to say which device the time went to. In a run that is
recorded it notes each attempt, and how it ended, also one that ended in an error which is none of a
line's: of the world behind a double.

Identities that hold whenever no transaction is under way, for the bus and for each address:

- attempts on the wire = `transactions` + `retries`
- transactions that failed for good = `errors` - `retries`

Retrying, a bounded number of attempts and never a wait, cures what passes by itself: a byte not
acknowledged, arbitration lost, an adapter's own fault. A timeout does not pass: a line is held, and
each further attempt would hold the loop for a whole adapter timeout. So `BusTimeout` is never
retried.
"""

import threading
from collections.abc import Callable, Sequence
from typing import Final

from msgspec import Struct

from firmware_runtime.hal.budget import NO_TIME, LineTime, framed_ns
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import (
    ArbitrationLost,
    BusFault,
    BusTimeout,
    HalError,
    NoAcknowledge,
    how_it_failed,
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


class BusCounters:
    """Counters of a bus, or of one address of it, since it was opened; counts only grow.

    `bytes` and `busy_ns` include address bytes and every attempt. A failed attempt ended early, but
    counts in full, so both are upper bounds once `errors` is not zero. `busy_ns` is computed
    (`hal.budget`), not measured.
    """

    def __init__(self) -> None:
        self.transactions = 0
        self.bytes = 0
        self.errors = 0
        self.retries = 0
        self.busy_ns = 0


class AccountedBus(I2cBus, BusCounters):
    """Any bus, with retries and counters, in total (its own attributes) and `by_address`.

    `overhead_ns` is what its adapter takes for a transaction beside the bits, `time` what the lines
    of this run live in. One lock: a transaction with its retries and its counts is one step,
    whichever thread asks.
    """

    def __init__(
        self,
        bus: I2cBus,
        bus_hz: int,
        retry: RetryPolicy = THREE_ATTEMPTS,
        *,
        overhead_ns: int = 0,
        time: LineTime = NO_TIME,
    ) -> None:
        super().__init__()
        self.name = bus.name
        self.bus_hz = bus_hz
        self.overhead_ns = overhead_ns
        self.retry = retry
        self.by_address: dict[int, BusCounters] = {}
        self._bus = bus
        self._time = time
        self._lock = threading.Lock()
        self._number = 0
        self._noted: list[tuple[object, ...]] | None = None
        self._now: Callable[[], int] = int

    def record(self, number: int, noted: list[tuple[object, ...]], now: Callable[[], int]) -> None:
        """From now on, append each attempt: this number, address, messages, how it ended, when.

        It ends with what was read, or with an error's class and sentence.
        """
        self._number, self._noted, self._now = number, noted, now

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        """Carry out one transaction, again where the policy says so; the last error is raised."""
        size, noted = len(messages), self._noted  # as `wire_bytes`, in a frame less
        for message in messages:
            size += message if isinstance(message, int) else len(message)
        busy_ns = self.overhead_ns + framed_ns(size, len(messages), self.bus_hz)
        with self._lock:
            device = self.by_address.get(address) or self._first_use(address)
            self.transactions += 1
            device.transactions += 1
            attempt = 1
            while True:
                self.bytes += size
                self.busy_ns += busy_ns
                device.bytes += size
                device.busy_ns += busy_ns
                try:
                    answer = self._bus.transaction(address, messages)
                except Exception as error:
                    self._note_failed(address, messages, error)
                    if not isinstance(error, HalError) or self._gives_up(error, attempt, device):
                        raise
                else:
                    if noted is not None:
                        now = self._now  # as a local, which CPython calls sooner
                        noted.append((self._number, address, messages, answer, now()))
                    if self._bus.returns_early:
                        self._time.reach(self._time() + busy_ns)
                    return answer
                attempt += 1

    def acknowledges(self, address: int) -> bool:
        """Ask once; a refusal is an answer, and no error."""
        with self._lock:
            answered = self._asks(address)
            size = 1 + answered
            busy_ns = self.overhead_ns + framed_ns(size, 1, self.bus_hz)
            for counters in (self, self.by_address.get(address) or self._first_use(address)):
                counters.transactions += 1
                counters.bytes += size
                counters.busy_ns += busy_ns
            if self._bus.returns_early:
                self._time.reach(self._time() + busy_ns)
            return answered

    def pause(self, span: int) -> None:
        """Let `span` ns pass on the bus underneath; a robot's lines are late by it."""
        self._bus.pause(span)

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way to the last transaction's end."""
        return self._time.elapsed()

    def close(self) -> None:
        """Close the bus underneath; the counters stay readable."""
        self._bus.close()

    def _asks(self, address: int) -> bool:
        """Whether something acknowledges; noted as the transaction that it is."""
        if self._noted is None:
            return self._bus.acknowledges(address)
        try:
            answer = self._bus.transaction(address, (1,))
        except Exception as error:
            self._note_failed(address, (1,), error)
            if isinstance(error, NoAcknowledge):
                return False
            raise
        self._noted.append((self._number, address, (1,), answer, self._now()))
        return True

    def _note_failed(self, address: int, messages: Sequence[Message], error: Exception) -> None:
        if self._noted is not None:
            failed = how_it_failed(error)
            self._noted.append((self._number, address, tuple(messages), failed, self._now()))

    def _first_use(self, address: int) -> BusCounters:
        return self.by_address.setdefault(address, BusCounters())

    def _gives_up(self, error: HalError, attempt: int, device: BusCounters) -> bool:
        """Count a failed attempt, and the retry if there will be one."""
        retried = attempt < self.retry.attempts and isinstance(error, self.retry.on)
        for counters in (self, device):
            counters.errors += 1
            counters.retries += retried
        return not retried
