"""Readings of a sensor on a serial line, as faults of what measures make them."""

from typing import Final, Protocol, runtime_checkable

from sim_doubles.altered_answers import CHANGES, OFFSET

OF_READINGS: Final = ("late", "freeze-axis", "offset", "scale", "full-scale", "noise")
"""Kinds of faults (`firmware_runtime.hal.strike`) that fit it; what it measures has no sign."""
_WORD: Final = 1 << 16


class AlteredReadings:
    """One measured number after the other, in counts from `least` to `most`.

    `altered` is told each as it is measured, and returns what is sent in its place. An offset is
    the same share of the range as it is of a word on an I2C bus, 3 %.
    """

    def __init__(self, least: int, most: int) -> None:
        self._least, self._most = least, most
        self._broken: dict[str, bool] = {}
        """Whether it is for one reading, by kind."""
        self._last: int | None = None
        """What was measured last."""
        self._before: dict[str, int] = {}
        """What was measured before a kind began, or with noise last."""

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
            if kind in {"noise", "late"}:
                self._before[kind] = now
            if once:
                self.heal(kind)
        self._last = now
        return max(self._least, min(self._most, found))

    def _changed(self, kind: str, before: int, now: int) -> int:
        match kind:
            case "late":
                return before
            case "offset":
                return now + OFFSET * (self._most - self._least) // _WORD
            case "full-scale":
                return self._most
            case _:
                return CHANGES[kind](before, now)


@runtime_checkable
class HasReadings(Protocol):
    """A double that measures one number, and sends it."""

    @property
    def readings(self) -> AlteredReadings:
        """What becomes of what it measures."""
