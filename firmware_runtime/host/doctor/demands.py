"""What a board asks of the machine, gathered from its settings."""

from firmware_runtime.board.registry import Board, BoardSettings
from firmware_runtime.host.doctor.machine import Demands

_STRETCHING = ("SRF08", "CMPS12", "MD25")
"""Chips run by a microcontroller, which may hold the clock low until it has an answer."""


def demands_of(board: Board) -> Demands:
    """Everything the checks compare the machine with."""
    settings: BoardSettings = board.settings
    executive = settings.executive
    nodes = {name: bus.device for name, bus in settings.buses.items()}
    return Demands(
        board=board.name,
        bus_hz={bus.device: round(bus.speed_hz) for bus in settings.buses.values()},
        addresses={
            node: [each.address for each in board.devices if each.bus == name]
            for name, node in nodes.items()
        },
        stretching={
            node: [
                each.chip.lower()
                for each in board.devices
                if each.bus == name and each.chip in _STRETCHING
            ]
            for name, node in nodes.items()
        },
        ports=[port.device for port in board.ports.values()],
        fifo_priority=executive.fifo_priority,
        lock_memory=executive.lock_memory,
        cpus=executive.cpus,
        keep_cpu_awake=executive.keep_cpu_awake,
    )
