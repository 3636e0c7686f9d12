"""Checks of a machine: what each is called, why it matters, what fixes it, and what it found."""

import grp
import os
import platform
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import NamedTuple

from firmware_runtime.system.device_nodes import NODES
from firmware_runtime.system.kernel_files import THIS_MACHINE, SystemFiles, computer_model


class Severity(StrEnum):
    """From good to bad; what does not apply, or cannot be seen, counts as good."""

    NOT_APPLICABLE = "not-applicable"
    OK = "ok"
    NOTE = "note"
    WARNING = "warning"
    FAILURE = "failure"

    @property
    def needs_attention(self) -> bool:
        """True if there is something to fix or to know."""
        return self in {Severity.NOTE, Severity.WARNING, Severity.FAILURE}


@dataclass(frozen=True, slots=True)
class Finding:
    """One check's answer, in words; `fix` where it is more exact than the check's own."""

    status: Severity
    seen: str
    fix: str | None = None


def ok(seen: str) -> Finding:
    """Nothing to fix."""
    return Finding(Severity.OK, seen)


def note(seen: str, fix: str | None = None) -> Finding:
    """Worth knowing."""
    return Finding(Severity.NOTE, seen, fix)


def warning(seen: str, fix: str | None = None) -> Finding:
    """It works, but not as well as it could, or not for long."""
    return Finding(Severity.WARNING, seen, fix)


def failure(seen: str, fix: str | None = None) -> Finding:
    """A run will fail, or not get what its board needs."""
    return Finding(Severity.FAILURE, seen, fix)


def not_applicable(reason: str) -> Finding:
    """There is nothing to examine, or it is not shown to this user."""
    return Finding(Severity.NOT_APPLICABLE, reason)


def worst(findings: list[Finding]) -> Severity:
    """The worst of all; not-applicable counts as ok."""
    order = list(Severity)
    return max((finding.status for finding in findings), key=order.index, default=Severity.OK)


TYPICAL_PRIORITY = 60
"""The SCHED_FIFO priority that is tried where no board states one."""


@dataclass(frozen=True, slots=True)
class Demands:
    """Demands of a board on the machine. Buses, ports and addresses go by device node."""

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
    has_enable_line: bool = False


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
        return self.files.matching(NODES)

    @property
    def ports(self) -> list[str]:
        """The nodes of the board's serial ports, or of all that look like a UART or an adapter."""
        if self.demands is not None:
            return list(self.demands.ports)
        kinds = ("ttyAMA*", "ttyUSB*", "ttyACM*", "serial[0-9]*")
        found = [node for kind in kinds for node in self.files.matching(f"/dev/{kind}")]
        return found + [node for node in self.files.matching("/dev/ttyS*") if self._is_real(node)]

    def _is_real(self, node: str) -> bool:
        """Return whether firmware describes a port: of a PC's four most have no hardware."""
        device = f"/sys/class/tty/{Path(node).name}/device"
        return any(self.files.exists(f"{device}/{by}") for by in ("of_node", "firmware_node"))

    @property
    def is_raspberry_pi(self) -> bool:
        """True if the device tree says so."""
        return (computer_model(self.files) or "").startswith("Raspberry Pi")


@dataclass(frozen=True, slots=True)
class Check:
    """`fix` is a command or a line of configuration; a finding may carry a more exact one."""

    id: str
    why: str
    fix: str
    examine: Callable[[Machine], Finding]


class Result(NamedTuple):
    """A check and what it found."""

    group: str
    check: Check
    finding: Finding

    @property
    def fix(self) -> str:
        """Return what fixes it, as exactly as is known."""
        return self.finding.fix or self.check.fix


def may_write(path: Path) -> bool:
    """Return whether a file may be opened for writing."""
    return os.access(path, os.W_OK)


def owning_group(path: Path) -> str | None:
    """The name of the group a node belongs to; None for root's own or one without a name."""
    try:
        number = path.stat().st_gid
        return grp.getgrgid(number).gr_name if number != 0 else None
    except (OSError, KeyError):
        return None


def nodes_usable(machine: Machine, nodes: Sequence[str]) -> Finding:
    """Return whether all of these nodes that exist may be read and written."""
    there = [node for node in nodes if machine.files.exists(node)]
    if not there:
        return not_applicable(f"{', '.join(nodes) or 'no node'}: not there")
    closed = [node for node in there if not os.access(machine.files.path(node), os.R_OK | os.W_OK)]
    if not closed:
        return ok(f"{', '.join(there)}: may be read and written")
    bad = warning if machine.demands is None else failure
    group = owning_group(machine.files.path(closed[0]))
    fix = None if group is None else f"sudo usermod -aG {group} $USER, then log in again"
    return bad(f"{', '.join(closed)}: may not be read and written by this user", fix)
