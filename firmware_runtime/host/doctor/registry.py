"""All checks, by theme, in the order in which they are carried out and shown."""

from collections.abc import Mapping

from firmware_runtime.board.registry import Board
from firmware_runtime.board.settings import BoardSettings
from firmware_runtime.host.doctor import (
    clock,
    gpio,
    i2c,
    installation,
    memory,
    processor,
    scheduling,
    serial_ports,
    service,
)
from firmware_runtime.host.doctor.check import (
    Check,
    Demands,
    Finding,
    Machine,
    Result,
    not_applicable,
)

GROUPS: Mapping[str, tuple[Check, ...]] = {
    "scheduling": scheduling.CHECKS,
    "processor": processor.CHECKS,
    "memory": memory.CHECKS,
    "clock": clock.CHECKS,
    "i2c": i2c.CHECKS,
    "gpio": gpio.CHECKS,
    "serial ports": serial_ports.CHECKS,
    "service": service.CHECKS,
    "installation": installation.CHECKS,
}


def examine(machine: Machine) -> list[Result]:
    """Carry out every check."""
    return [
        Result(group, check, _examine(check, machine))
        for group, checks in GROUPS.items()
        for check in checks
    ]


def _examine(check: Check, machine: Machine) -> Finding:
    """Return what a check finds; what the kernel shows in a form not foreseen cannot be judged."""
    try:
        return check.examine(machine)
    except (OSError, ValueError, LookupError) as error:
        return not_applicable(f"cannot be judged: {type(error).__name__}: {error}")


def demands_of(board: Board) -> Demands:
    """Everything the checks compare the machine with."""
    settings: BoardSettings = board.settings
    executive = settings.executive
    on_node = {
        bus.device: [each for each in board.devices if each.bus == name]
        for name, bus in settings.buses.items()
    }
    return Demands(
        board=board.name,
        bus_hz={bus.device: round(bus.speed_hz) for bus in settings.buses.values()},
        addresses={node: [each.address for each in devices] for node, devices in on_node.items()},
        stretching={
            node: [each.chip.lower() for each in devices if each.stretches_clock]
            for node, devices in on_node.items()
        },
        ports=[port.device for port in board.ports.values()],
        fifo_priority=executive.fifo_priority,
        lock_memory=executive.lock_memory,
        cpus=executive.cpus,
        keep_cpu_awake=executive.keep_cpu_awake,
        has_enable_line=settings.output_enable is not None,
    )
