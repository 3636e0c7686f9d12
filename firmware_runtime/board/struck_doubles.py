"""Doubles of a board that can be broken: by the names of its devices, and what has been broken.

A rig needs nothing for that but lines that are `Breakable`, as buses and ports of doubles are. One
that is `Pushable` can be pushed too, one that is `Holdable` can be held.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from typing import Final, Protocol, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from firmware_runtime.board.faults import Device, SerialDevice
from firmware_runtime.board.rig import Holdable, Pushable
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.errors import ConfigError, suggested
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.spans import Spans
from firmware_runtime.hal.strike import (
    KINDS,
    OF_NO_DEVICE,
    Breakable,
    Kind,
    Place,
    Span,
    Strike,
    Struck,
)


class HasDevices(Protocol):
    """A board, or a set of chips without one."""

    @property
    def source(self) -> Path | None:
        """The file of its settings."""

    @property
    def assignments(self) -> Sequence[str]:
        """Numbers of its board.toml that were overridden, `KEY=VALUE`."""

    @property
    def devices(self) -> Sequence[Device]:
        """Chips on I2C buses."""

    @property
    def serial_devices(self) -> Sequence[SerialDevice]:
        """Chips on serial ports."""


class NoDevices(Struct, frozen=True):
    """Nothing that has a name of its own: lines and addresses only."""

    source: Path | None = None
    assignments: Sequence[str] = ()
    devices: Sequence[Device] = ()
    serial_devices: Sequence[SerialDevice] = ()


NO_DEVICES: Final = NoDevices()
Blamed: TypeAlias = Callable[[str], AbstractContextManager[None]]
"""Given what is done, a context in which it is."""


class HasLines(Protocol):
    """Doubles on their lines."""

    @property
    def buses(self) -> Mapping[str, I2cBus]:
        """The buses by name."""

    @property
    def ports(self) -> Mapping[str, SerialPort]:
        """The serial ports by name."""


class Operator(Protocol):
    """Who commands a run: keeps it disarmed, arms it again, has it take up its settings."""

    def disarm(self, at: int, until: int) -> None:
        """Keep it disarmed from an instant to another, which may be NEVER."""

    def reload(self, at: int) -> None:
        """Have it take up its settings again at an instant, as they are."""

    def end(self, at: int) -> None:
        """Let what has no end be over at an instant."""

    def clear(self) -> None:
        """Disarm it no more."""


class StruckDoubles:
    """Doubles in this process, on the clock `now`, and the faults that were made on them.

    `stall` lets so many ns of a run in virtual time pass in which it does nothing; of a run on them
    there is an `operator`, too. `blamed` takes what pushing and holding raises for a fault of what
    does it.
    """

    def __init__(  # noqa: PLR0913, PLR0917 -- a run has more to it than doubles alone
        self,
        doubles: HasLines,
        devices: HasDevices,
        now: Callable[[], int],
        stall: Callable[[int], None] | None = None,
        operator: Operator | None = None,
        blamed: Blamed | None = None,
    ) -> None:
        self._doubles = doubles
        self._stall = stall
        self._operator = operator
        self._blamed = blamed or _unblamed
        self._now = now
        self._lines = dict(_breakable(doubles))
        self.places = [*_places(self._lines, devices, self._fit)]
        """What can be struck by name: devices first, then lines."""
        self.struck: list[Struck] = []
        """Faults made so far, in the order in which they were asked for."""
        self._held = Spans()
        """Ns of the doubles in which their robot is held."""

    @property
    def kinds(self) -> list[Kind]:
        """Kinds of faults that can be made here."""
        fitting = {kind for place in self.places for kind in place.kinds}
        found = [kind for name, kind in KINDS.items() if name in fitting]
        if self._stall is not None:
            found.append(KINDS["stall"])
        if self._operator is not None:
            found += [kind for kind in KINDS.values() if kind.of == "people"]
        if isinstance(self._doubles, Pushable):
            found.append(replace(KINDS["push"], unit=self._doubles.push_unit))
        if isinstance(self._doubles, Holdable):
            found.append(KINDS["hold"])
        return found

    def strike(self, strike: Strike, since: int = 0) -> Struck:
        """Make a fault, its instant counted from `since`, ns. Raises ConfigError if it cannot be.

        One that is due is there when this returns; what had its instant before begins now.
        """
        if (fault := strike.fault()) is not None:
            raise ConfigError.of_one("fault", fault)
        kind = KINDS[strike.kind]
        if kind.name not in [each.name for each in self.kinds]:
            known = ", ".join(each.name for each in self.kinds)
            raise ConfigError.of_one(
                "fault", f"{kind.name}: not on these doubles", f"one of {known}"
            )
        at = max(since + strike.at, self._now())
        amount = strike.extent
        until = NEVER if strike.span == NEVER else at + strike.span
        if kind.of in OF_NO_DEVICE and strike.device:
            fault = f"{strike.kind} of {strike.device}"
            raise ConfigError.of_one("fault", fault, "it without a device")
        if kind.name == "disarm" and self._operator is not None:
            self._operator.disarm(at, until)
        elif kind.name == "reload" and self._operator is not None:
            self._operator.reload(at)
        elif kind.name == "hold":
            self._held.add(at, until)
            self._call_at(at, self._hold)
            self._call_at(until, self._hold)
        elif kind.of in OF_NO_DEVICE:
            self._call_at(at, partial(self._strike_all, kind.name, amount or 0.0))
        else:
            once = strike.span == 0 and not kind.is_moment
            span = Span(at, NEVER if once else until, once)
            for line, address in self._struck_places(strike):
                line.strike(kind.name, address, span, amount or 0.0)
        span_ns = None if strike.span == NEVER else strike.span
        struck = Struck(kind.name, strike.device, at, span_ns, amount)
        self.struck.append(struck)
        return struck

    def end(self, at: int) -> None:
        """Let every fault that has no end be over after `at`, as if it had been made so."""
        for line in self._lines.values():
            line.end_strikes(at)
        if self._operator is not None:
            self._operator.end(at)
        if self._held:
            self._held.end(at)
            self._call_later(at, self._hold)  # also where a use ends at that instant
        self.struck = [each if each.span is not None else _ended(each, at) for each in self.struck]

    def clear(self) -> None:
        """End all faults; what had no supply has it again, and is in its power-up state."""
        at = self._now()
        for line in self._lines.values():
            line.clear_strikes()
        if self._operator is not None:
            self._operator.clear()
        if self._held:
            self._held.clear()
            self._hold()
        self.struck = [_ended(each, at) for each in self.struck if each.at <= at]

    def _fit(self, line: Breakable, address: int | None) -> tuple[str, ...]:
        fitting = line.fitting(address)
        return tuple(kind for kind in KINDS if kind in fitting)

    def _strike_all(self, kind: str, amount: float) -> None:
        """Push the robot, or stall its computer."""
        if kind == "stall" and self._stall is not None:
            self._stall(max(0, round(amount * MILLISECOND)))
        elif isinstance(self._doubles, Pushable):
            with self._blamed("push"):
                self._doubles.catch_up()
                self._doubles.push(amount)

    def _hold(self) -> None:
        """Hold the robot, or let go of it, as it is to be now."""
        if isinstance(self._doubles, Holdable):
            with self._blamed("hold"):
                self._doubles.catch_up()
                self._doubles.hold(is_held=self._held.have(self._now()))

    def _call_at(self, at: int, action: Callable[[], None]) -> None:
        """Call once, now or with the first use of any line after `at`; at NEVER not at all."""
        if at <= self._now():
            action()
        elif at != NEVER:
            self._call_later(at, action)

    def _call_later(self, at: int, action: Callable[[], None]) -> None:
        """Call once, with the first use of any line after `at`."""
        has_been = False

        def happen() -> None:
            nonlocal has_been
            if not has_been:  # each line calls; the first one counts
                has_been = True
                action()

        for line in self._lines.values():
            line.call_at(at, happen)

    def _struck_places(self, strike: Strike) -> list[tuple[Breakable, int | None]]:
        """The lines, and the chip on each. Raises ConfigError if there is none that it fits."""
        found = self._found(strike.device)
        fitting = [place for place in found if strike.kind in place.kinds]
        if not fitting:
            kinds = ", ".join(found[0].kinds)
            fault = f"{strike.kind} does not fit {strike.device}, a {found[0].what}"
            raise ConfigError.of_one("fault", fault, f"one of {kinds}")
        return [(self._lines[place.line], place.address) for place in fitting]

    def _found(self, device: str) -> list[Place]:
        """Places of a name or an address; every line for an empty one. Raises ConfigError."""
        if not device:
            return [place for place in self.places if place.is_line]
        if named := [place for place in self.places if place.name == device]:
            return named[:1]
        line, at, text = device.rpartition("@")
        address = _address(text)
        on = [
            place
            for place in self.places
            if place.is_line and (place.name == line if at else True)
            if address in {*self._lines[place.line].addresses, *self._known(place.line)}
        ]
        if address is None or not on:
            known = suggested(device, self._names(), f"expected one of {', '.join(self._names())}")
            raise ConfigError.of_one("fault", f"no device, line or address {device!r}; {known}")
        return [replace(place, name=device, address=address, is_line=False) for place in on]

    def _known(self, line: str) -> set[int | None]:
        return {place.address for place in self.places if place.line == line} - {None}

    def _names(self) -> list[str]:
        return [place.name for place in self.places]


def _unblamed(_done: str) -> AbstractContextManager[None]:
    return nullcontext()


def _breakable(doubles: HasLines) -> Iterator[tuple[str, Breakable]]:
    for lines in (doubles.buses, doubles.ports):
        for name, line in lines.items():
            if isinstance(line, Breakable):
                yield name, line


def _places(
    lines: dict[str, Breakable],
    devices: HasDevices,
    fit: Callable[[Breakable, int | None], tuple[str, ...]],
) -> Iterator[Place]:
    for device in devices.devices:
        if (line := lines.get(device.bus)) is not None:
            yield Place(
                device.key, device.chip, device.bus, device.address, fit(line, device.address)
            )
    for wired in devices.serial_devices:
        if (line := lines.get(wired.port)) is not None:
            yield Place(wired.key, wired.chip, wired.port, None, fit(line, None))
    for name, line in lines.items():
        yield Place(name, "", name, None, fit(line, None), is_line=True)


def _address(text: str) -> int | None:
    try:
        return int(text, 0)
    except ValueError:
        return None


def _ended(struck: Struck, at: int) -> Struck:
    """Return a fault as it was if it is ended at an instant."""
    if struck.span is not None and struck.at + struck.span <= at:
        return struck
    return replace(struck, span=at - struck.at)
