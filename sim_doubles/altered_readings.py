"""Measured numbers, as faults of what measures make them: words of a chip, or on a serial line."""

from collections.abc import Callable, Mapping
from typing import Final, Protocol, runtime_checkable

OFFSET: Final = "offset"
LESS: Final = "offset, less"
"""Kinds of a number that jumps up, and down."""
COUNTS: Final = 2000
"""Counts of 65,536 that an offset jumps by."""
NOISE: Final = 10
"""By how much a number changes more than it does."""
_WORD: Final = 1 << 16
_CHANGES: Final[Mapping[str, Callable[[int, int], int]]] = {
    "late": lambda before, _: before,
    "freeze-axis": lambda before, _: before,
    "scale": lambda _, now: 2 * now,
    "negate": lambda _, now: -now,
    "noise": lambda before, now: before + NOISE * (now - before),
}
"""What becomes of a number, by kind: of what it was before, and what is measured now."""
_BY_THE_LAST: Final = frozenset({"late", "noise"})
"""Kinds to which what was before is the last one, not that before it broke."""
OF_READINGS: Final = ("late", "freeze-axis", "offset", "scale", "full-scale", "noise")
"""Kinds of faults (`firmware_runtime.hal.strike`) of a sensor that sends one number of no sign."""


class AlteredReadings:
    """One measured number after the other, in counts from `least` to `most`.

    `altered` is told each as it is measured, and returns what is sent in its place. An offset is
    3 % of the range.
    """

    def __init__(self, least: int, most: int) -> None:
        self._least, self._most = least, most
        self._broken: dict[str, bool] = {}
        """Whether it is for one reading, by kind."""
        self._last: int | None = None
        """What was measured last."""
        self._before: dict[str, int] = {}
        """What was measured before a kind began, or last."""

    @property
    def is_broken(self) -> bool:
        """Return whether there is any fault."""
        return bool(self._broken)

    def break_(self, kind: str, *, once: bool) -> None:
        """Make a fault of a kind from the next reading on, or of that one."""
        self._broken[kind] = once
        if self._last is not None:
            self._before[kind] = self._last

    def heal(self, kind: str) -> None:
        """End a fault of a kind."""
        self._broken.pop(kind, None)
        self._before.pop(kind, None)

    def altered(self, now: int) -> int:
        """Return what is sent in place of what is measured now."""
        found = now
        for kind, once in tuple(self._broken.items()):
            found = self._changed(kind, self._before.setdefault(kind, now), found)
            if kind in _BY_THE_LAST:
                self._before[kind] = now
            if once:
                self.heal(kind)
        self._last = now
        return max(self._least, min(self._most, found))

    def _changed(self, kind: str, before: int, now: int) -> int:
        if kind in {OFFSET, LESS}:
            counts = COUNTS * (self._most - self._least + 1) // _WORD
            return now + (counts if kind == OFFSET else -counts)
        if kind == "full-scale":
            return self._least if now < 0 else self._most
        return _CHANGES[kind](before, now)


@runtime_checkable
class HasReadings(Protocol):
    """A double that measures one number, and sends it."""

    @property
    def readings(self) -> AlteredReadings:
        """What becomes of what it measures."""
