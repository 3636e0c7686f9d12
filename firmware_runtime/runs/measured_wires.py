"""Clocks of a board's wires as `doctor --measure` timed them, kept beside its statistics.

They are those of this boot: what a bus runs at is set when the computer starts.
"""

from collections.abc import Iterator, Mapping
from time import monotonic_ns
from typing import Final

from firmware_runtime.board.registry import Board
from firmware_runtime.hal.wire_clock import MeasuredWire
from firmware_runtime.statistics.paths import Companion, default_path, places
from firmware_runtime.system.this_process import NoteOfBoot, boot_id, leave_note, read_note

DIFFERENCE: Final = 0.05
"""Share by which a wire's clock may differ from the stated one: dividers are whole numbers."""
_MODE: Final = 0o644


class MeasuredWires(NoteOfBoot, frozen=True, kw_only=True):
    """What was measured in this boot, by device node."""

    wires: Mapping[str, MeasuredWire]


def keep_measured(board: str, wires: Mapping[str, MeasuredWire]) -> None:
    """Keep what was timed on wires, for later checks. Raises OSError, StatisticsFileError."""
    note = MeasuredWires(boot_id=boot_id(), at_ns=monotonic_ns(), wires=wires)
    leave_note(Companion.MEASURED.beside(default_path(board)), note, _MODE)


def measured_wires(board: str) -> Mapping[str, MeasuredWire]:
    """Return what has been measured for a board since the computer started, by device node."""
    notes = (read_note(Companion.MEASURED.beside(each), MeasuredWires) for each in places(board))
    return next((note.wires for note in notes if note is not None), {})


def differs(wire: MeasuredWire, stated_hz: float) -> bool:
    """Return whether a wire's clock is another than the stated one."""
    return abs(wire.speed_hz - stated_hz) > DIFFERENCE * stated_hz


def clock_warnings(board: Board) -> Iterator[str]:
    """Yield a sentence for each bus whose wire runs at another clock than the board says."""
    found = measured_wires(board.name)
    for name, bus in board.settings.buses.items():
        wire = found.get(bus.device)
        if wire is not None and differs(wire, bus.speed_hz):
            yield (
                f"buses.{name}.speed_hz: {bus.speed_hz:g}, but the wire was measured at "
                f"{wire.speed_hz} Hz since the computer started; expected that here, or the wire "
                f"at {bus.speed_hz:g} Hz (`doctor --measure {board.name}` times it)"
            )
