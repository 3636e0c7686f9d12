"""One check: what it is called, why it matters, what fixes it, and how to examine it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from firmware_runtime.host.doctor.finding import Finding
from firmware_runtime.host.doctor.machine import Machine


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
        """What fixes it, as exactly as is known."""
        return self.finding.fix or self.check.fix
