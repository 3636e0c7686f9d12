"""Deadlines on a path from a sensor to an actuator.

The time of a path starts when a message leaves the sensor's port, at the logical instant of that
step, which is the deadline of the sensor's activation: the sample was due then, and being late
counts. It ends, on the run's clock, when a transition of the actuator's model that read input has
returned, and with it the write to the chip. A sample that leaves while another is on its way looks
at the clock as it was when the output function began.

Whether an answer was caused by a certain sample cannot be seen from outside. So a transition of the
actuator answers all samples that left before it, and the oldest of them is measured. A sample that
is over its limit when the next one leaves is a miss without an answer, and so is one at the end of
the run. With a command a sample, as in a control loop, that is exact.

A path is enabled by its first answer. Before that samples leave and nothing is to be done about
them: a controller waits for a propeller to be armed, a gate is shut. They are counted, and none is
a miss; a path that never was enabled has samples and no answer.
"""

from collections.abc import Sequence
from typing import Any

from msgspec import Struct

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.errors import SettingError


class PathDeadline(Struct, frozen=True):
    """A sample that leaves `from_port` is to be in effect at `to_model` within `within_ns`."""

    name: str
    from_port: OutPort[Any]
    to_model: Atomic
    within_ns: int

    def __post_init__(self) -> None:
        """Raise SettingError for ends that are none, or no time within which to answer."""
        source: object = self.from_port
        actuator: object = self.to_model
        within: object = self.within_ns
        if not (isinstance(source, OutPort) and isinstance(actuator, Atomic)):
            ends = f"{source!r} -> {actuator!r}"
            raise SettingError(f"deadline {self.name}: {ends}", expected="an OutPort and an Atomic")
        if not (isinstance(within, int) and within > 0):
            raise SettingError(f"deadline {self.name}: {self.within_ns!r} ns", expected="1 or more")

    def missing_from(self, atomics: Sequence[Atomic]) -> list[str]:
        """Which of its ends are no part of these models, as faults."""
        source, actuator = self.from_port, self.to_model
        return [
            f"deadline {self.name}: {path} is not of an atomic model of this robot"
            for path, atomic in ((source.path, source.owner), (actuator.path, actuator))
            if atomic not in atomics
        ]
