"""Time of a robot's lines: what transactions take, and from when on a device waits.

A model lives at the instants of its events; within one, each transaction takes its time on the
wire, and the lines run ahead of the model by it. A device that needs time needs it from the end of
the transaction, so a phase that waits for it is longer by what the lines have run ahead
(`elapsed`). `firmware_drivers.hardware.HardwareModel.hold_after_transfer` adds that.
"""

from typing import Final, Protocol


class LineTime(Protocol):
    """The time in which all lines of one robot live; call it for the instant they have come to."""

    def __call__(self) -> int:
        """Return the instant, in ns since the start of the run; it never goes back."""

    def reach(self, at: int) -> None:
        """Go on to `at`, where a transaction ended; nothing happens if that is past already."""

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way to where the lines are now."""


class Line(Protocol):
    """A bus or a port, as far as waiting for what is connected to it goes."""

    name: str

    def elapsed(self) -> int:
        """Return the ns from the instant of the step under way to the end of the last transfer."""


class _NoTime:
    """A line outside of any run: nothing takes time."""

    def __call__(self) -> int:
        return 0

    def reach(self, at: int) -> None:
        """Stay where it is."""

    def elapsed(self) -> int:
        return 0


NO_TIME: Final = _NoTime()


class WireClock(Protocol):
    """A clock for a whole rig: transactions on its buses take their time on it."""

    def __call__(self) -> int:
        """Return the present instant, in ns."""

    def reach(self, at: int) -> None:
        """Go on to `at`, unless that is past."""
