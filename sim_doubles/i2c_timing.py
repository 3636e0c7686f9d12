"""How long the transaction under way has lasted on the wire of a bus double, and a clock's part."""

from collections.abc import Callable

from firmware_runtime.hal.budget import wire_ns
from sim_doubles.clock import Now


class WireTiming:
    """Moves a clock on, by its `reach`, with the bits that go over a bus; without one, nothing."""

    def __init__(
        self, now: Now, reach: Callable[[int], None] | None, bus_hz: int, overhead_ns: int
    ) -> None:
        self._now = now
        self._reach = reach
        self._bus_hz = bus_hz
        self._overhead_ns = overhead_ns
        self._began_at = 0
        self._bits = 0

    def begin(self) -> None:
        """Let the adapter's overhead pass; the transaction begins on the wire."""
        if self._reach is not None:
            self._bits = 0
            self._began_at = self._now() + self._overhead_ns
            self._reach(self._began_at)

    def pause(self, span: int) -> None:
        """Let `span` ns pass between two transactions."""
        if self._reach is not None:
            self._reach(self._now() + span)

    def take(self, bits: int) -> None:
        """Let that many more bits of the transaction take their time."""
        if self._reach is not None:
            self._bits += bits
            self._reach(self._began_at + wire_ns(self._bits, self._bus_hz))
