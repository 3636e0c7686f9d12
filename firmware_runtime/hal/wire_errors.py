"""Errors of a wire, the same for Linux and for the doubles, and the fault that reports one.

The executive counts every `Fault` that leaves an output port of this type, in any model, whether
or not anything is coupled to the port.
"""

import errno
from itertools import chain
from typing import Final, NamedTuple

from firmware_runtime.errors import FirmwareRuntimeError, text_of


class HalError(FirmwareRuntimeError):
    """The world did not cooperate. Expected, counted, retried or reported as a `Fault`."""


class NoAcknowledge(HalError, OSError):
    """SDA was not pulled low: no such device, or it refused a byte, or it is busy."""


class ArbitrationLost(HalError, OSError):
    """Another controller on the same bus won; nothing of ours arrived."""


class BusTimeout(HalError, TimeoutError):
    """The transaction did not finish in time: SCL or SDA is held, the bus is stuck."""


class BusFault(HalError, OSError):
    """The adapter reported an error of its own: wrong length, a clock stretched too far."""


class AddressInUse(HalError, OSError):
    """A kernel driver holds the address; unbind it first."""


class BusAbsent(HalError, OSError):
    """The bus or port does not exist or may not be opened."""


class BusInUse(BusAbsent):
    """Another process drives what is on the bus, and has locked it."""


class PortClosed(HalError, OSError):
    """The bus or port was used after it was closed."""


class WrongDevice(HalError):
    """Something answers at the address, but its identity is not the expected chip's."""


class NotReady(HalError):
    """The device answered, but has no valid value yet. Never replaced by zeros."""


class DeadReading(HalError):
    """A part answered, and its answer shows that it does not measure: never passed on as a value.

    `where` names the part; `axis` says which of its quantities, in words, and `value` what that
    reads, in counts unless the sentence has a unit; `readings` is how many in a row showed it.
    """

    def __init__(self, where: str, axis: str, value: float, readings: int, what: str) -> None:
        self.where = where
        self.axis = axis
        self.value = value
        self.readings = readings
        super().__init__(f"{where}: {axis} {what}")


SOME_NOISE: Final = "some noise; it hangs"
"""What is expected of a reading that repeats itself."""


class Stuck(DeadReading):
    """A reading, or a bit of it, stays the same for longer than a working part's can.

    `expected` ends the sentence.
    """

    def __init__(
        self,
        where: str,
        axis: str,
        value: float,
        readings: int,
        expected: str = SOME_NOISE,
    ) -> None:
        super().__init__(
            where,
            axis,
            value,
            readings,
            f"reads {value:g} in {readings} readings in a row, expected {expected}",
        )


class Implausible(DeadReading):
    """A reading that no working part gives here: beyond its range, or against another source.

    `expected` ends the sentence, and names the unit.
    """

    def __init__(
        self, where: str, axis: str, value: float, expected: str, *, readings: int = 1
    ) -> None:
        self.expected = expected
        super().__init__(where, axis, value, readings, f"is {value:.4g}, expected {expected}")


class Runaway(Implausible):
    """A motor turned, and was not told to: what it moves is not where its controller has it."""


EREMOTEIO: Final[int] = getattr(errno, "EREMOTEIO", 121)
"""Linux's number for what was not acknowledged, also on a system that has no such number."""
_NAMES: Final = {EREMOTEIO: "EREMOTEIO", **errno.errorcode}
_FAULT: Final = "the adapter reported a fault"
_BY_ERRNO: dict[int, tuple[type[HalError], str]] = {
    # bcm2835 and designware report 121, i2c-gpio and i2c-tiny-usb 6
    EREMOTEIO: (NoAcknowledge, "not acknowledged, expected a device that answers"),
    errno.ENXIO: (NoAcknowledge, "not acknowledged, expected a device that answers"),
    errno.EAGAIN: (ArbitrationLost, "arbitration lost to another controller on the bus"),
    errno.ETIMEDOUT: (BusTimeout, "timed out, a device or a fault holds the bus"),
    errno.EBUSY: (AddressInUse, "a kernel driver holds this address, expected it to be free"),
    errno.ENOENT: (BusAbsent, "no such device node"),
    errno.EACCES: (BusAbsent, "permission denied"),
    errno.EPERM: (BusAbsent, "permission denied"),
    errno.ENODEV: (BusAbsent, "no such device"),
    errno.EIO: (BusFault, _FAULT),
    errno.EOPNOTSUPP: (BusFault, "the adapter cannot do this, such as a read that is not last"),
    errno.EBADF: (PortClosed, "used after it was closed"),
}


def from_os_error(error: OSError, where: str) -> HalError:
    """Translate an adapter's errno, once, into one of ours; what has no row is a `BusFault`.

    `where` names bus and address for the sentence. Source: Linux 6.1 I2C adapter drivers.
    """
    kind, what = _BY_ERRNO.get(error.errno or 0, (BusFault, _FAULT))
    name = _NAMES.get(error.errno or 0, "no errno")
    return kind(f"{where}: {what} ({name})")


def how_it_failed(error: Exception) -> tuple[str, str]:
    """An error as a recording has it: its class and its sentence."""
    return type(error).__name__, str(error)


def errno_of(kind: str, sentence: str) -> int:
    """The errno that an error was made of, by the name of its class and its sentence.

    EIO for one that had none.
    """
    named = sentence.rpartition("(")[2].removesuffix(")")
    said = (number for number, name in _NAMES.items() if name == named)
    of_kind = (number for number, (each, _) in _BY_ERRNO.items() if each.__name__ == kind)
    return next(chain(said, of_kind), errno.EIO)


WARNING: Final = "Warning"
"""Kind of a `Fault` that is none: a device works, less well than it should."""


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
