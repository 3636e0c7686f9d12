"""Deviations: transactions that were not the recorded ones at their point."""

from collections.abc import Callable
from dataclasses import dataclass

from firmware_runtime.devs.time import SECOND
from sim_doubles.recorded.traffic import Recorded, device_of, in_words


@dataclass(frozen=True, slots=True)
class Deviation:
    """`due` is what the recording has next on that line, None after its end."""

    line: str
    due: Recorded | None
    address: int
    messages: object
    done: str
    """What became of it: that it was refused, or what it was answered by."""

    def __str__(self) -> str:
        asked = f"asked {device_of(self.line, self.address)} {self.asked}; {self.done}"
        if self.due is None:
            return f"after the last recorded transaction of {self.line}: {asked}"
        then = self.due.transfer
        place = f"transaction {self.due.number}, {device_of(self.line, then.address)}"
        instant = f"at {then.at / SECOND:.6f} s of the run"
        return f"{place}, {instant}: recorded {in_words(then.address, then.messages)}, {asked}"

    @property
    def asked(self) -> str:
        """What was asked, in words."""
        return in_words(self.address, self.messages)

    def as_json(self) -> dict[str, object]:
        """For the log."""
        recorded = None if self.due is None else self.due.transfer
        return {
            "number": None if self.due is None else self.due.number,
            "line": self.line,
            "recorded": recorded and in_words(recorded.address, recorded.messages),
            "recorded_device": recorded and device_of(self.line, recorded.address),
            "run_ns": recorded and recorded.at,
            "asked": self.asked,
            "device": device_of(self.line, self.address),
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
