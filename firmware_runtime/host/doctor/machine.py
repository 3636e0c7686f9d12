"""What the checks examine: this machine, and what a board needs of it if one is named."""

import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from firmware_runtime.system.kernel_files import THIS_MACHINE, SystemFiles, computer_model

TYPICAL_PRIORITY = 60
"""The SCHED_FIFO priority that is tried where no board states one."""


@dataclass(frozen=True, slots=True)
class Demands:
    """What a board needs of the machine. Buses, ports and addresses go by device node."""

    board: str
    bus_hz: Mapping[str, int] = field(default_factory=dict)
    addresses: Mapping[str, Sequence[int]] = field(default_factory=dict)
    stretching: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """Its chips that may stretch the clock, by bus."""
    ports: Sequence[str] = ()
    fifo_priority: int = 0
    lock_memory: bool = False
    cpus: Sequence[int] = ()
    keep_cpu_awake: bool = False


@dataclass(frozen=True, slots=True)
class Machine:
    """This machine, or in tests a tree of files that looks like one."""

    files: SystemFiles = THIS_MACHINE
    demands: Demands | None = None
    kernel_release: str = field(default_factory=platform.release)
    kernel_build: str = field(default_factory=platform.version)

    @property
    def priority(self) -> int:
        """The SCHED_FIFO priority to judge by; 0 if the board has none."""
        return TYPICAL_PRIORITY if self.demands is None else self.demands.fifo_priority

    @property
    def buses(self) -> list[str]:
        """The nodes of the board's I2C buses, or of all there are."""
        if self.demands is not None:
            return list(self.demands.bus_hz)
        return self.files.matching("/dev/i2c-*")

    @property
    def ports(self) -> list[str]:
        """The nodes of the board's serial ports, or of all that look like a UART or an adapter."""
        if self.demands is not None:
            return list(self.demands.ports)
        kinds = ("ttyAMA*", "ttyUSB*", "ttyACM*", "serial[0-9]*")
        return [node for kind in kinds for node in self.files.matching(f"/dev/{kind}")]

    @property
    def is_raspberry_pi(self) -> bool:
        """Whether the device tree says so."""
        return (computer_model(self.files) or "").startswith("Raspberry Pi")
