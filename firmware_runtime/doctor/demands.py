"""What a board asks of the machine, gathered from its settings."""

from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from boards.registry import Board, BoardSettings
from drivers.chips import hmc5883l
from firmware_runtime.doctor.machine import Demands

_FIXED_ADDRESSES = {"hmc5883l": hmc5883l.ADDRESS}
"""Of chips that a board file gives no address."""
_STRETCHING = ("srf08", "cmps12", "md25")
"""Chips run by a microcontroller, which may hold the clock low until it has an answer."""


class _Device(NamedTuple):
    chip: str
    bus: str
    address: int


def demands_of(board: Board) -> Demands:
    """Everything the checks compare the machine with."""
    settings: BoardSettings = board.settings
    executive = settings.executive
    nodes = {name: bus.device for name, bus in settings.buses.items()}
    devices = [device for device in _devices(board.settings) if device.bus in nodes]
    return Demands(
        board=board.name,
        bus_hz={bus.device: round(bus.speed_hz) for bus in settings.buses.values()},
        addresses={
            node: [each.address for each in devices if each.bus == name]
            for name, node in nodes.items()
        },
        stretching={
            node: [each.chip for each in devices if each.bus == name and each.chip in _STRETCHING]
            for name, node in nodes.items()
        },
        ports=[port.device for port in board.ports.values()],
        fifo_priority=executive.fifo_priority,
        lock_memory=executive.lock_memory,
        cpus=executive.cpus,
        keep_cpu_awake=executive.keep_cpu_awake,
    )


def _devices(settings: msgspec.Struct) -> Iterator[_Device]:
    """The tables of a board file that name a bus, with the chip's address on it."""
    for table in msgspec.structs.asdict(settings).values():
        bus = getattr(table, "bus", None)
        chip = getattr(table, "chip", None) or getattr(table, "driver", None) or ""
        address = getattr(table, "address", None) or _FIXED_ADDRESSES.get(chip)
        if bus is not None and address is not None:
            yield _Device(chip, bus, address)
