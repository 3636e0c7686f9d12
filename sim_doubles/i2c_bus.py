"""An I2C bus of doubles, as drivers have it: transactions, errors, faults and a log.

What happens between START and STOP is in `i2c_wire`. Whatever goes wrong ends in a STOP and the
errno that the chosen Linux adapter would report: `transfer` raises the bare OSError, `transaction`
the `HalError` a driver sees.

A transaction takes its time on the clock whose `reach` is given: its bits at the bus's speed and,
before START, the adapter's overhead. Without `reach` everything happens at one instant.

Not modelled: clock stretching, the second or so that an adapter waits for a held line, other
controllers; lost arbitration can only be injected (`sim_doubles.faults`).
"""

import errno
import threading
from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import TYPE_CHECKING, NoReturn

from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import from_os_error
from sim_doubles.clock import Now
from sim_doubles.i2c_target import ADAPTERS, AdapterProfile, Target
from sim_doubles.i2c_wire import BlockRead, Transaction, Wire, WireTiming, os_error

if TYPE_CHECKING:  # what only a script of faults needs is not made for a bus without one
    from firmware_runtime.hal.strike import Span, Use
    from sim_doubles.bus_strikes import BusStrikes
    from sim_doubles.faults import FaultScript
    from sim_doubles.scripted_fault import Alteration

__all__ = ["BlockRead", "I2cBusDouble", "Target", "Transaction"]


class I2cBusDouble(Wire, I2cBus):
    """A bus by its name, with its targets and the errno profile of one Linux adapter.

    One lock: a transaction is one step, whichever thread asks, as with a real adapter.
    `faults` may be set at any time; without it faults cost nothing. `transactions`, `errors`,
    `bytes` and `bits` count since construction; `log` keeps the last `log_length` transactions.
    """

    def __init__(  # noqa: PLR0913 (the bus as wired: each argument is one line of the schematic)
        self,
        name: str,
        now: Now,
        targets: Sequence[Target],
        *,
        adapter: str = "bcm2835",
        bus_hz: int = 400_000,
        overhead_ns: int = 0,
        reach: Callable[[int], None] | None = None,
        faults: "FaultScript | None" = None,
        log_length: int = 256,
    ) -> None:
        if adapter not in ADAPTERS:
            raise ValueError(f"{name}: adapter is {adapter!r}, expected one of {list(ADAPTERS)}")
        super().__init__(ADAPTERS[adapter], WireTiming(now, reach, bus_hz, overhead_ns))
        self.name = name
        self.bus_hz = bus_hz
        self.faults = faults
        self._absent: list[Target] = []
        self.log: deque[Transaction] = deque(maxlen=log_length)
        self.transactions = self.errors = 0
        self._now = now
        self._targets = tuple(targets)
        self._pulses_missing = 0
        self._closed = self._holds = False
        self._broken: BusStrikes | None = None
        self._lock = threading.Lock()

    @property
    def targets(self) -> tuple[Target, ...]:
        """Return the targets connected, in the order in which a START reaches them."""
        return self._targets

    @property
    def warnings(self) -> list[str]:
        """Return what its targets note: what a real chip would ignore, refuse or not define."""
        return [each for target in self._targets for each in getattr(target, "warnings", ())]

    @property
    def adapter(self) -> AdapterProfile:
        """The Linux adapter whose errors it reports."""
        return self._adapter

    def be_behind(self, adapter: str) -> None:
        """Report errors, and refuse messages, as another Linux adapter does from now on."""
        self._adapter = ADAPTERS[adapter]

    def connect(self, *targets: Target) -> None:
        """Wire more targets to the bus, between two transactions."""
        with self._lock:
            self._targets += targets

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        """Carry out one transaction; return what was read, in order, joined."""
        try:
            return self.transfer(address, messages)
        except OSError as error:
            raise from_os_error(error, f"{self.name} 0x{address:02x}") from error

    def transfer(self, address: int, messages: Sequence[Message]) -> bytes:
        """Carry out one transaction as the adapter does; raises a plain OSError with its errno."""
        messages = tuple(messages)
        with self._lock:
            if self._holds:
                self._stop_what_is_held()
            return self._transferred((address,) * len(messages), messages, 1)

    def transfer_parts(
        self, parts: Sequence[tuple[int, Message]], *, continues: bool = False, holds: bool = False
    ) -> bytes:
        """Carry out messages to addresses of their own as one transaction, or as a piece of one.

        A piece that `holds` ends without STOP, and the one that `continues` it begins with a
        repeated START. Whatever else comes in between ends the transaction held. Faults, counters
        and log take each piece as a transaction to the first address.
        """
        addresses, messages = (tuple(each) for each in zip(*parts, strict=True))
        with self._lock:
            if not continues:
                self._stop_what_is_held()
            try:
                answer = self._transferred(addresses, messages, 0 if holds else 1)
            except OSError:
                self._stop_what_is_held()  # whatever went wrong, it ends with STOP
                raise
            self._holds = holds
            return answer

    def _stop_what_is_held(self) -> None:
        if self._holds:
            self._holds = False
            for target in self._targets:
                target.stop()

    def _transferred(
        self, addresses: tuple[int, ...], messages: tuple[Message, ...], stop_bits: int
    ) -> bytes:
        now = self._now  # as a local, which CPython calls sooner
        at, address = now(), addresses[0] if addresses else 0
        try:
            refused_with = self._adapter.refusal(messages, len(messages) - stop_bits)
            if refused_with is not None or self._closed or self._pulses_missing:
                self._refuse(refused_with)
            if self.faults is None:
                if self._absent:
                    self._disconnect([])
                answer = self._carry(at, self._targets, addresses, messages, stop_bits)
            else:
                answer = self._with_faults(self.faults, at, addresses, messages, stop_bits)
        except OSError as error:
            self.errors += 1
            self.log.append(Transaction(at, address, messages, b"", error.errno))
            raise
        finally:
            self.transactions += 1
        self.log.append(Transaction(at, address, messages, answer, None))
        return answer

    @property
    def stuck(self) -> bool:
        """Return whether a target holds SDA low."""
        return self._pulses_missing > 0

    def recover(self, pulses: int = 9) -> None:
        """Clock SCL `pulses` times with SDA released, then STOP; frees a stuck bus in the end."""
        with self._lock:
            self._pulses_missing = max(0, self._pulses_missing - pulses)
            for target in self._targets:
                target.stop()

    def power_cycle(self) -> None:
        """Take the supply from every target and give it back; a stuck bus is free again."""
        with self._lock:
            self._pulses_missing = 0
            for target in self._targets:
                target.power_cycle()

    # Faults by kind (`firmware_runtime.hal.strike`)

    def fitting(self, address: int | None) -> Collection[str]:
        """Return the kinds of faults that fit the chip with this address; None is any."""
        return self._strikes().fitting(address)

    @property
    def addresses(self) -> Collection[int]:
        """Addresses of its chips, of those whose double says it."""
        found = (getattr(target, "address", None) for target in self._targets)
        return [address for address in found if isinstance(address, int)]

    @property
    def struck_at(self) -> int | None:
        """The instant at which a fault made by `strike` first showed; None before."""
        return self._strikes().struck_at

    def uses(self) -> Iterator["Use"]:
        """Yield the transactions of the log, the newest first."""
        from firmware_runtime.hal.strike import Use  # noqa: PLC0415 -- as faults

        for each in reversed(self.log):
            yield Use(each.at, each.address, each.to_read > 0, bool(each.written))

    def strike(self, kind: str, address: int | None, span: "Span", amount: float) -> None:
        """Make a fault of a kind, at the chip with this address or at all."""
        self._strikes().strike(kind, address, span, amount)

    def call_at(self, at: int, action: Callable[[], None]) -> None:
        """Call at `at`, or with the first transaction after it."""
        self._strikes().call_at(at, action)

    def end_strikes(self, at: int) -> None:
        """Let every fault that has no end be over after `at`, as if it had been made so."""
        self._strikes().end(at)

    def clear_strikes(self) -> None:
        """End every fault that `strike` has made."""
        self._strikes().clear()

    def pause(self, span: int) -> None:
        """Let `span` ns pass on the clock that transactions take their time on."""
        self._timing.pause(span)

    def close(self) -> None:
        """Release the bus; the targets go on as they are."""
        self._closed = True

    def _strikes(self) -> "BusStrikes":
        if self._broken is None:
            from sim_doubles.bus_strikes import BusStrikes  # noqa: PLC0415 -- as faults

            self._broken = BusStrikes(self, self._now)
        return self._broken

    def _refuse(self, refused_with: int | None) -> NoReturn:
        """Raise what ends a transaction before its START; the adapter may refuse its messages."""
        if self._closed:
            raise os_error(errno.EBADF)
        raise os_error(self._adapter.no_completion if refused_with is None else refused_with)

    def _with_faults(
        self,
        script: "FaultScript",
        at: int,
        addresses: tuple[int, ...],
        messages: tuple[Message, ...],
        stop_bits: int,
    ) -> bytes:
        """Carry out a transaction with what the script has due in it."""
        alteration = script.alteration(self.transactions, at, addresses[0], messages)
        self._disconnect([] if alteration is None else alteration.absent)
        if alteration is None:
            return self._carry(at, self._targets, addresses, messages, stop_bits)
        self._fail_before_start(alteration)
        if alteration.delay:
            self._timing.pause(alteration.delay)
            at = self._now()
        reachable = [] if alteration.address_refused else self._present(alteration)
        messages_left = alteration.cut(messages)
        answer = self._carry(at, reachable, addresses, messages_left, stop_bits)
        if alteration.refused_byte is not None:
            self.bytes += 1
            raise os_error(self._adapter.byte_refused)
        return alteration.tampered(addresses[0], messages, answer, self.log)

    def _fail_before_start(self, alteration: "Alteration") -> None:
        for target in alteration.browned_out:
            target.power_cycle()
        if alteration.pulses:
            self._pulses_missing = alteration.pulses
            raise os_error(self._adapter.no_completion)
        if alteration.errno is not None:
            raise os_error(alteration.errno)

    def _disconnect(self, absent: list[Target]) -> None:
        """Keep these targets off every bus, and no others, from this transaction on."""
        for target in self._absent:
            target.is_connected = True
        for target in absent:
            target.is_connected = False
        self._absent = absent

    def _present(self, alteration: "Alteration") -> list[Target]:
        return [target for target in self._targets if target not in alteration.absent]
