"""Faults by kind on a bus of doubles: each becomes entries of the bus's script (`faults`).

A chip without supply is off from the instant of the strike where that is now, else from the next
transaction on its bus; likewise it comes back.
"""

import errno
from collections.abc import Callable, Collection, Iterator
from typing import Any, Final, Protocol

from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.hal.strike import KINDS, Span
from sim_doubles.altered_answers import (
    AlteredWord,
    InvertedBits,
    LateAnswer,
    can_be_altered,
)
from sim_doubles.clock import Now
from sim_doubles.faults import (
    AbsentTarget,
    AdapterError,
    BrokenOutput,
    BrownOut,
    ConstantAnswer,
    Delay,
    Fault,
    FaultScript,
    FrozenAnswer,
    Happening,
    NackAddress,
    NackByte,
)
from sim_doubles.i2c_target import AdapterProfile, Target
from sim_doubles.outputs import HasOutputs

OF_ANY: Final = tuple(name for name, kind in KINDS.items() if kind.of in {"I2C", "chip"})
OF_SENSORS: Final = tuple(name for name, kind in KINDS.items() if kind.of == "sensor")
OF_OUTPUTS: Final = tuple(name for name, kind in KINDS.items() if kind.of == "actuator")


class ScriptedBus(Protocol):
    """A bus with a script of faults, as `I2cBusDouble` is."""

    faults: FaultScript | None

    @property
    def targets(self) -> tuple[Target, ...]:
        """Its chips."""

    @property
    def adapter(self) -> AdapterProfile:
        """The adapter whose errors it reports."""


class BusStrikes:
    """The faults that were made on a bus by kind, until `clear`."""

    def __init__(self, bus: ScriptedBus, now: Now) -> None:
        self._bus = bus
        self._now = now
        self._made: list[Fault] = []
        self._all: set[Fault] = set()

    @property
    def struck_at(self) -> int | None:
        """The instant at which one of them first showed, of the last thousand strikes."""
        script = self._bus.faults
        record = () if script is None else script.record
        return next((each.at for each in record if each.fault in self._all), None)

    def fitting(self, address: int | None) -> Collection[str]:
        """Return the kinds that fit the chip with this address, or any."""
        targets = self._targets(address)
        measured = [words for each in targets for words in each.measured]
        of_sensors = tuple(
            kind for kind in OF_SENSORS if any(can_be_altered(words, kind) for words in measured)
        )
        of_outputs = OF_OUTPUTS if any(isinstance(each, HasOutputs) for each in targets) else ()
        return (*OF_ANY, *of_sensors, *of_outputs)

    def strike(self, kind: str, address: int | None, span: Span, amount: float) -> None:
        """Make a fault of a kind, at the chip with this address or at all."""
        self._forget_past()
        if KINDS[kind].of == "chip" and span.since <= self._now():
            for target in self._targets(address):
                target.power_cycle()
        self._add(*self._faults(kind, address, span, amount))

    def call_at(self, at: int, action: Callable[[], None]) -> None:
        """Call at `at`, or with the first transaction after it."""
        self._add(Happening(since=at, action=action))

    def end(self, at: int) -> None:
        """Let those that have no end be over after `at`, which is not past."""
        now = self._now()
        for fault in [each for each in self._made if each.until == NEVER and _lasts(each)]:
            fault.end(at)
            if isinstance(fault, AbsentTarget):
                self._add(*_cycles((fault.target,), at + 1, now))
            if isinstance(fault, BrokenOutput):
                self._add(*_healed(fault.target, at))

    def clear(self) -> None:
        """End them all; what had no supply, or was to lose it, is in its power-up state."""
        at = self._now()
        for fault in self._made:
            self._remove(fault)
            if isinstance(fault, AbsentTarget) and fault.since <= at <= fault.until:
                fault.target.power_cycle()
            if isinstance(fault, BrokenOutput):
                fault.target.heal_outputs()
        self._made.clear()

    def _add(self, *faults: Fault) -> None:
        if self._bus.faults is None:
            self._bus.faults = FaultScript()
        for fault in faults:
            self._bus.faults.add(fault)
            self._made.append(fault)
            if not isinstance(fault, Happening):
                self._all.add(fault)

    def _remove(self, fault: Fault) -> None:
        if self._bus.faults is not None:
            self._bus.faults.remove(fault)

    def _forget_past(self) -> None:
        """Take those out of the script that are over: it is searched at each transaction."""
        at, script = self._now(), self._bus.faults
        for fault in [each for each in self._made if _is_over(each, at, script)]:
            self._remove(fault)
            self._made.remove(fault)

    def _targets(self, address: int | None) -> tuple[Target, ...]:
        """Return the chips that answer at an address, all of the bus for None."""
        targets = self._bus.targets
        if address is None:
            return targets
        said = tuple(each for each in targets if getattr(each, "address", None) == address)
        return said or tuple(each for each in targets if _answers(each, address))

    def _faults(self, kind: str, address: int | None, span: Span, amount: float) -> Iterator[Fault]:
        when: dict[str, Any] = {"since": span.since, "until": span.until}
        times, targets = 1 if span.once else None, self._targets(address)
        match KINDS[kind].of:
            case "sensor":
                said: dict[str, Any] = {"kind": kind, "number": int(amount), "times": times}
                for each in targets:
                    at = address if address is not None else getattr(each, "address", None)
                    if each.measured:
                        yield AlteredWord(address=at, target=each, **when, **said)
            case "I2C":
                fault, details = _on_wires(kind, self._bus.adapter, amount)
                yield fault(address=address, times=times, **when, **details)
            case "actuator":
                for each in targets:
                    if isinstance(each, HasOutputs):
                        yield BrokenOutput(target=each, kind=kind, number=int(amount), **when)
                        yield from _healed(each, span.until)
            case _:
                yield from _off(kind, targets, span, self._now())


def _healed(target: HasOutputs, until: int) -> Iterator[Fault]:
    if until < NEVER:
        yield Happening(since=until + 1, action=target.heal_outputs)


def _off(kind: str, targets: tuple[Target, ...], span: Span, now: int) -> Iterator[Fault]:
    """The supply of chips fails, for a moment or for a while."""
    yield from _cycles(targets, span.since, now)
    if kind == "absent":
        yield from (
            AbsentTarget(target=each, since=span.since, until=span.until) for each in targets
        )
        if span.until < NEVER:
            yield from _cycles(targets, span.until + 1, now)


def _on_wires(
    kind: str, adapter: AdapterProfile, amount: float
) -> tuple[type[Fault], dict[str, Any]]:
    """Return the fault of a kind, and what it needs to know beside when and where."""
    known: dict[str, tuple[type[Fault], dict[str, Any]]] = {
        "nack": (NackAddress, {}),
        "nack-data": (NackByte, {"index": 0}),
        "stuck": (AdapterError, {"errno": adapter.no_completion}),
        "arbitration": (AdapterError, {"errno": errno.EAGAIN}),
        "fault": (AdapterError, {"errno": errno.EIO}),
        "freeze": (FrozenAnswer, {}),
        "zero": (ConstantAnswer, {"byte": 0x00}),
        "ones": (ConstantAnswer, {"byte": 0xFF}),
        "late": (LateAnswer, {}),
        "flip": (InvertedBits, {"number": int(amount)}),
        "wrong-byte": (InvertedBits, {"number": int(amount), "mask": 0xFF}),
        "slow": (Delay, {"span": max(0, round(amount * MILLISECOND))}),
    }
    return known[kind]


def _lasts(fault: Fault) -> bool:
    """Return whether it has an end of its own, in time."""
    return fault.times is None or isinstance(fault, BrokenOutput)


def _is_over(fault: Fault, at: int, script: FaultScript | None) -> bool:
    is_spent = script is not None and script.count(fault) >= (fault.times or NEVER)
    return fault.until < at or (is_spent and not _lasts(fault))


def _cycles(targets: tuple[Target, ...], at: int, now: int) -> Iterator[Fault]:
    """Power cycles that are still to come."""
    return (BrownOut(target=each, since=at) for each in targets if at > now)


def _answers(target: Target, address: int) -> bool:
    """Return whether a chip acknowledges its address, without being told anything."""
    acknowledged = target.start(address, read=False)
    target.stop()
    return acknowledged
