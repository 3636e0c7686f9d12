"""Which boards fit what was found on the buses, and what each one lacks."""

from collections.abc import Sequence
from typing import NamedTuple

from drivers.commands.probing import ProbedBus
from firmware_runtime.board.faults import Device
from firmware_runtime.board.registry import Board


class Fit(NamedTuple):
    """One board beside what was found."""

    board: str
    devices: dict[str, str]
    """The device node that suits each of its buses best."""
    present: list[Device]
    missing: list[Device]
    assignments: list[str]
    """What to `--set` where that is another node than the board's file says."""
    unasked: list[str]
    """Serial ports: what hangs there cannot be asked."""

    @property
    def fits(self) -> bool:
        """Whether every chip on a bus was found."""
        return not self.missing


def fit(board: Board, buses: Sequence[ProbedBus]) -> Fit:
    """Compare a board with the buses; each of its own is matched with the best there is."""
    fitted = Fit(board.name, {}, [], [], [], [f"ports.{name}" for name in board.ports])
    for name, stated in board.settings.buses.items():
        wanted = [device for device in board.devices if device.bus == name]
        # the stated node first: of equals, max takes the first
        ranked = sorted(buses, key=lambda bus: bus.device != stated.device)
        best = max(ranked, key=lambda bus: _count(wanted, bus), default=None)
        for device in wanted:
            there = best is not None and _is_there(device, best)
            (fitted.present if there else fitted.missing).append(device)
        if best is not None and _count(wanted, best):
            fitted.devices[name] = best.device
            if best.device != stated.device:
                fitted.assignments.append(f"buses.{name}.device={best.device}")
    return fitted


def _count(wanted: Sequence[Device], bus: ProbedBus) -> int:
    return sum(_is_there(device, bus) for device in wanted)


def _is_there(device: Device, bus: ProbedBus) -> bool:
    return any(
        found.address == device.address and device.chip in found.chips for found in bus.found
    )
