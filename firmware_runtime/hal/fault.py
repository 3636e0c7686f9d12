"""What a model puts on a port when the world did not cooperate.

The executive counts every `Fault` that leaves an output port of this type, in any model, whether
or not anything is coupled to the port.
"""

from typing import NamedTuple

from firmware_runtime.errors import FirmwareRuntimeError, text_of
from firmware_runtime.hal.wire_errors import DeadReading


class Fault(NamedTuple):
    """One thing that went wrong, in words; never a number that could be taken for a value."""

    kind: str
    """The error's class, such as `NoAcknowledge` or `NotReady`."""
    reason: str
    """One sentence: where, what, expected."""
    consecutive: int
    """How many in a row of this model, this one included."""
    axis: str = ""
    """Which quantity is dead or implausible, of `Stuck` and `Implausible`; empty for any other."""
    value: float = 0.0
    """What it reads, in the unit of the sentence."""
    duration: int = 0
    """Ns for which it has read so; 0 where the model reads at no period."""

    @classmethod
    def of(cls, error: FirmwareRuntimeError, consecutive: int, period: int = 0) -> "Fault":
        """The fault that an error stands for; `period` is the ns from reading to reading."""
        kind, reason = type(error).__name__, text_of(error)
        if not isinstance(error, DeadReading):
            return cls(kind, reason, consecutive)
        value, duration = float(error.value), error.readings * period
        return cls(kind, reason, consecutive, error.axis, value, duration)
