"""A chip driver that answers as scripted, for tests of the hardware model above it."""

from collections.abc import Callable
from typing import TypeVar

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.hal.wire_errors import HalError, NoAcknowledge

T = TypeVar("T")

SILENT = NoAcknowledge("scripted chip: no answer, expected one")


class ScriptedLine:
    """A line on which all transfers of a step take as long as it says, in ns."""

    name = "scripted line"

    def __init__(self) -> None:
        self.takes = 0

    def elapsed(self) -> int:
        return self.takes


class ScriptedChip:
    """Keeps what was asked of it and when, in ms; a script's last entry is its answer after it."""

    place = "scripted chip"

    def __init__(self) -> None:
        self.line = ScriptedLine()
        self.now: Callable[[], int] = lambda: 0
        self.calls: list[tuple[object, float]] = []

    def answer(self, call: object, script: list[T | HalError]) -> T:
        self.calls.append((call, self.now() / MILLISECOND))
        answer = script.pop(0) if len(script) > 1 else script[0]
        if isinstance(answer, HalError):
            raise answer
        return answer

    def times(self, call: object) -> list[float]:
        return [at for each, at in self.calls if each == call]
