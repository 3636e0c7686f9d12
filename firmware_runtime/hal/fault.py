"""What a model puts on a port when the world did not cooperate.

The executive counts every `Fault` that leaves an output port of this type, in any model, whether
or not anything is coupled to the port.
"""

from typing import NamedTuple

from firmware_runtime.errors import FirmwareRuntimeError, text_of


class Fault(NamedTuple):
    """One thing that went wrong, in words; never a number that could be taken for a value."""

    kind: str
    """The error's class, such as `NoAcknowledge` or `NotReady`."""
    reason: str
    """One sentence: where, what, expected."""
    consecutive: int
    """How many in a row of this model, this one included."""

    @classmethod
    def of(cls, error: FirmwareRuntimeError, consecutive: int) -> "Fault":
        """The fault that an error stands for."""
        return cls(type(error).__name__, text_of(error), consecutive)
