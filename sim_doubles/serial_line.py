"""A serial line of doubles, in process: a port that a driver speaks to.

Bytes reach a target at the instant they are written, as if they took no time on the wire; drivers
count their waits from when they have left all the same (`hal.accounted_port`). What a target sends
arrives at the pace the target gives it. Not modelled: the host's baud rate, so a wrong one does no
harm; an output buffer that fills, an input buffer that overflows.

A line is opened by making it: what the target sent before is lost, as on a closed port.

A target is a device at the other end, as the line sees it: bytes in, bytes out.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Collection, Iterator
from functools import partial
from operator import itemgetter
from typing import TYPE_CHECKING, Final, NamedTuple

from firmware_runtime.devs.time import NEVER
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import BusFault, PortClosed
from sim_doubles.altered_readings import OF_READINGS, HasReadings
from sim_doubles.clock import Now
from sim_doubles.outputs import HasOutputs

if TYPE_CHECKING:
    from firmware_runtime.hal.strike import Span, Use

_LASTING: Final = ("silent", "absent")
_MOMENTS: Final = ("drop", "garble", "brown-out")
_OF_OUTPUTS: Final = ("ignored", "weak", "dead", "full-on")


class SerialTarget(ABC):
    """Anything with a serial port of its own; what it sends by itself is worked out when read."""

    @abstractmethod
    def receive(self, data: bytes) -> None:
        """Take bytes from the host, now."""

    @abstractmethod
    def transmitted(self, at: int) -> bytes:
        """Return the bytes whose last bit is out by `at` and that were not returned before."""

    @abstractmethod
    def power_cycle(self) -> None:
        """Lose supply and get it back: everything volatile is at its power-up value."""


__all__ = ["SerialLineDouble", "SerialTarget", "Traffic"]


class Traffic(NamedTuple):
    """One logged write to the target, or one read that was not empty."""

    at: int
    written: bool
    data: bytes

    def __str__(self) -> str:
        """Direction and bytes, for people: `W 80 00 3f 3f`."""
        return f"{'W' if self.written else 'R'} {self.data.hex(' ')}"


class SerialLineDouble(SerialPort):
    """A port by its name with one target at the other end.

    `log` keeps the last `log_length` writes and reads. Faults: `unplugged` True is a USB adapter
    pulled out, every use raises BusFault; `cut` and `reconnect` part and join the wires, which no
    port notices; `strike` makes those that have a kind (`firmware_runtime.hal.strike`).
    """

    addresses: Collection[int] = ()

    def __init__(self, name: str, now: Now, target: SerialTarget, *, log_length: int = 256) -> None:
        self.name = name
        self.unplugged = False
        self.log: deque[Traffic] = deque(maxlen=log_length)
        self._now = now
        self._target = target
        self._arrived = b""
        self._cut = self._closed = False
        self._due: list[tuple[int, Callable[[], None]]] = []
        self._broken: set[str] = set()
        self._broken_outputs: set[str] = set()
        self._endless: dict[str, int] = {}
        """When faults begin that have no end yet, by kind."""
        self._to_drop = self._to_garble = 0
        self.struck_at: int | None = None
        """The instant at which a fault made by `strike` began; None before."""
        target.transmitted(now())

    @property
    def warnings(self) -> list[str]:
        """Return what its target notes: what a real device would not take as meant."""
        return list(getattr(self._target, "warnings", ()))

    def write(self, data: bytes) -> None:
        """Send bytes to the target. Raises PortClosed, or BusFault without an adapter."""
        self._check()
        self.log.append(Traffic(self._now(), written=True, data=bytes(data)))
        if self._due:
            self._catch_up()
        if not (self._cut or self._broken):
            self._target.receive(self._as_it_arrives(bytes(data)))

    def read_available(self) -> bytes:
        """Take what has arrived by now. Raises PortClosed, or BusFault without an adapter."""
        self._check()
        self._catch_up()
        data, self._arrived = self._arrived, b""
        if data:
            self.log.append(Traffic(self._now(), written=False, data=data))
        return data

    def close(self) -> None:
        """Release the port; the target goes on as it is."""
        self._closed = True

    def cut(self) -> None:
        """Part the wires: from now on bytes are lost, both ways."""
        self._catch_up()
        self._cut = True

    def reconnect(self) -> None:
        """Join the wires; what was sent in between is lost."""
        self._catch_up()
        self._cut = False

    # Faults by kind

    def uses(self) -> Iterator["Use"]:
        """Yield the writes and the reads of the log, the newest first."""
        from firmware_runtime.hal.strike import Use  # noqa: PLC0415 -- of a line that is broken

        for each in reversed(self.log):
            yield Use(each.at, None, not each.written, each.written)

    def fitting(self, _address: int | None) -> Collection[str]:
        """Return the kinds of faults that it knows."""
        has_outputs = isinstance(self._target, HasOutputs)
        of_readings = OF_READINGS if isinstance(self._target, HasReadings) else ()
        return (*_LASTING, *_MOMENTS, *(_OF_OUTPUTS if has_outputs else ()), *of_readings)

    def strike(self, kind: str, _address: int | None, span: "Span", amount: float) -> None:
        """Make a fault of a kind."""
        self.call_at(span.since, partial(self._break, kind, int(amount), once=span.once))
        if kind in _MOMENTS or span.once:
            return
        if span.until < NEVER:
            self.call_at(span.until + 1, partial(self._heal, kind))
        else:
            self._endless[kind] = span.since

    def call_at(self, at: int, action: Callable[[], None]) -> None:
        """Call at `at`, or when the line is next used after it."""
        self._due = sorted([*self._due, (at, action)], key=itemgetter(0))
        self._catch_up()

    def end_strikes(self, at: int) -> None:
        """Let every fault that has no end be over after `at`, as if it had been made so."""
        endless, self._endless = self._endless, {}
        for kind, since in endless.items():
            self.call_at(max(at, since) + 1, partial(self._heal, kind))

    def clear_strikes(self) -> None:
        """End every fault that `strike` has made."""
        self._catch_up()
        self._due.clear()
        self._endless.clear()
        self._to_drop = self._to_garble = 0
        for kind in (*self._broken, *self._broken_outputs, *OF_READINGS):
            self._heal(kind)

    def _break(self, kind: str, amount: int, *, once: bool) -> None:
        if self.struck_at is None:
            self.struck_at = self._now()
        if isinstance(self._target, HasOutputs) and kind in _OF_OUTPUTS:
            self._broken_outputs.add(kind)
            self._target.break_output(kind, amount)
            return
        if isinstance(self._target, HasReadings) and kind in OF_READINGS:
            self._target.readings.break_(kind, once=once)
            return
        if kind in _LASTING:
            self._broken.add(kind)
        if kind == "drop":
            self._to_drop += 1
        elif kind == "garble":
            self._to_garble += 1
        elif kind != "silent":
            self._target.power_cycle()

    def _heal(self, kind: str) -> None:
        if isinstance(self._target, HasReadings):
            self._target.readings.heal(kind)
        if isinstance(self._target, HasOutputs) and kind in self._broken_outputs:
            self._broken_outputs.clear()
            self._target.heal_outputs()
        if kind == "absent":
            self._target.power_cycle()
        self._broken.discard(kind)

    def _catch_up(self) -> None:
        """Fetch what was sent by now; what is due happens in between, in order."""
        now = self._now()
        while self._due and self._due[0][0] <= now:
            at, action = self._due.pop(0)
            self._fetch_until(at)
            action()
        self._fetch_until(now)

    def _fetch_until(self, at: int) -> None:
        sent = self._target.transmitted(at)
        if not (self._cut or self._broken):
            self._arrived += self._as_it_arrives(sent)

    def _as_it_arrives(self, data: bytes) -> bytes:
        """Return bytes on the line without those that are to be dropped, garbled ones inverted."""
        lost = min(self._to_drop, len(data))
        self._to_drop -= lost
        garbled = min(self._to_garble, len(data) - lost)
        self._to_garble -= garbled
        inverted = bytes(byte ^ 0xFF for byte in data[lost : lost + garbled])
        return inverted + data[lost + garbled :]

    def _check(self) -> None:
        if self._closed:
            raise PortClosed("used after it was closed", where=self.name)
        if self.unplugged:
            raise BusFault("the adapter is gone", where=self.name)
