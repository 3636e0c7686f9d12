"""Traffic of a recorded run by line, numbered in the order of the run, and deviations from it."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any, Final

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.reader import Recording
from firmware_runtime.recording.blackbox.section import DISCARD, READ, WRITE, Transfer
from firmware_runtime.recording.replay.feed import device_name

_ON_A_PORT: Final = {WRITE: "W", READ: "R", DISCARD: "throw away"}


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recorded transaction; an attempt that failed is one of its own.

    `number` counts those of all lines that are served, from 1; `place` those of its line, from 0.
    """

    number: int
    place: int
    transfer: Transfer

    def asks(self, address: int, messages: object) -> bool:
        """Return whether it is of this device and has these messages, bytes and lengths."""
        return (self.transfer.address, self.transfer.messages) == (address, messages)


@dataclass(frozen=True, slots=True)
class Traffic:
    """The transactions of each line; `ports` are those lines that are serial ports."""

    lines: dict[str, list[Recorded]]
    ports: frozenset[str]
    total: int


def traffic_of(recording: Recording, chosen: Collection[str], begin: int) -> Traffic:
    """Return the traffic of these lines, or of all, from instant `begin` of the run on, ns.

    Raises ConfigError for a line that the run did not have, and where nothing is left.
    """
    header = recording.header
    path = str(recording.path)
    if strange := [name for name in chosen if name not in header.lines]:
        had = ", ".join(header.lines) or "none"
        faults = [f"{name}: no line of this run; expected one of {had}" for name in strange]
        raise ConfigError(path, faults)
    lines: dict[str, list[Recorded]] = {name: [] for name in chosen or header.lines}
    total = 0
    for segment in recording.segments():
        for section in segment.sections():
            for transfer in section.transfers:
                name = header.lines[transfer.line]
                if name in lines and transfer.at >= begin:
                    total += 1
                    lines[name].append(Recorded(total, len(lines[name]), transfer))
    if not total:
        fault = "nothing went over these lines then; expected a transaction to answer"
        raise ConfigError.of_one(path, fault)
    ports = frozenset(header.table.get("ports", {})) & lines.keys()
    return Traffic(lines, ports, total)


def in_words(address: int, messages: Any) -> str:  # noqa: ANN401 -- of a bus or of a port
    """Return the bytes that a transaction writes, in hex, and the number that it reads."""
    if address < 0:
        return " ".join((_ON_A_PORT.get(address, "?"), bytes(messages).hex())).strip()
    return ", ".join(
        f"R {each}" if isinstance(each, int) else f"W {each.hex()}".strip() for each in messages
    )


@dataclass(frozen=True, slots=True)
class Deviation:
    """`due` is what the recording has next on that line, None after its end."""

    line: str
    due: Recorded | None
    address: int
    messages: object
    done: str
    """Outcome: refused, or the answer that it got."""

    def __str__(self) -> str:
        asked = f"asked {device_name(self.line, self.address)} {self.asked}; {self.done}"
        if self.due is None:
            return f"after the last recorded transaction of {self.line}: {asked}"
        then = self.due.transfer
        place = f"transaction {self.due.number}, {device_name(self.line, then.address)}"
        instant = f"at {then.at / SECOND:.6f} s of the run"
        return f"{place}, {instant}: recorded {in_words(then.address, then.messages)}, {asked}"

    @property
    def asked(self) -> str:
        """Return the transaction asked for, in words."""
        return in_words(self.address, self.messages)

    def as_json(self) -> dict[str, object]:
        """For the log."""
        recorded = None if self.due is None else self.due.transfer
        return {
            "number": None if self.due is None else self.due.number,
            "line": self.line,
            "recorded": recorded and in_words(recorded.address, recorded.messages),
            "recorded_device": recorded and device_name(self.line, recorded.address),
            "run_ns": recorded and recorded.at,
            "asked": self.asked,
            "device": device_name(self.line, self.address),
            "done": self.done,
        }


class Deviations:
    """Counts them, and hands each on; one that follows itself, as a retry does, is only counted."""

    def __init__(self, report: Callable[[Deviation], None]) -> None:
        self.count = 0
        self._report = report
        self._last: Deviation | None = None

    def add(self, deviation: Deviation) -> None:
        """One more."""
        self.count += 1
        if deviation != self._last:
            self._last = deviation
            self._report(deviation)
