"""Traffic of a bus, as lines to compare: `0x40 W 00, R 11`.

    assert i2c_log == ["0x68 W 75, R 71", "0x68 W 6b 80"]

Where they differ pytest shows the lines side by side, each that is missing or too many.
"""

import difflib
from collections.abc import Iterator, Sequence
from typing import overload

from sim_doubles.i2c_bus import I2cBusDouble


class WireLog(Sequence[str]):
    """The transactions of a bus since `clear`, at most the last ten thousand; equal to a list."""

    __hash__ = None  # type: ignore[assignment]

    def __init__(self, bus: I2cBusDouble) -> None:
        self._bus = bus

    @property
    def lines(self) -> list[str]:
        """One line a transaction, in order; a failed one ends with its errno."""
        return [str(each) for each in self._bus.log]

    def clear(self) -> None:
        """Forget what went before."""
        self._bus.log.clear()

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> list[str]: ...
    def __getitem__(self, index: int | slice) -> str | list[str]:
        return self.lines[index]

    def __len__(self) -> int:
        return len(self._bus.log)

    def __iter__(self) -> Iterator[str]:
        return iter(self.lines)

    def __eq__(self, other: object) -> bool:
        return self.lines == list(other) if isinstance(other, Sequence) else NotImplemented

    def __repr__(self) -> str:
        return f"{len(self)} transactions on {self._bus.name}"


def explained(left: object, right: object) -> list[str] | None:
    """Say where a log and the lines expected differ; None where neither is a log."""
    if isinstance(right, WireLog):
        left, right = right, left
    if not isinstance(left, WireLog) or not isinstance(right, Sequence):
        return None
    shown = difflib.unified_diff([str(each) for each in right], left.lines, lineterm="", n=2)
    return [f"{left!r}: - was expected, + was there", *list(shown)[2:]]
