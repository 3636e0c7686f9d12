"""What can go wrong on a wire: a short closed list, the same for Linux and for the doubles."""

import errno

from firmware_runtime.errors import FirmwareRuntimeError


class HalError(FirmwareRuntimeError):
    """The world did not do what was asked. Expected, counted, retried or reported as a `Fault`."""


class NoAcknowledge(HalError, OSError):
    """Nobody pulled SDA low: no such device, or it refused a byte, or it is busy."""


class ArbitrationLost(HalError, OSError):
    """Another controller on the same bus won; nothing of ours arrived."""


class BusTimeout(HalError, TimeoutError):
    """The transaction did not finish in time: SCL or SDA is held, the bus is stuck."""


class BusFault(HalError, OSError):
    """The adapter reported a transfer error of its own (length mismatch, clock stretched too far)."""


class AddressInUse(HalError, OSError):
    """A kernel driver holds the address; unbind it first."""


class BusAbsent(HalError, OSError):
    """The bus, line or port does not exist or may not be opened."""


class PortClosed(HalError, OSError):
    """The bus or port was used after it was closed."""


class WrongDevice(HalError):
    """Something answers at the address, but its identity is not the expected chip's."""


class NotReady(HalError):
    """The device answered, but has no valid value yet. Never replaced by zeros."""


_BY_ERRNO: dict[int, type[HalError]] = {
    errno.EREMOTEIO: NoAcknowledge,  # bcm2835, designware: address or data not acknowledged
    errno.ENXIO: NoAcknowledge,  # i2c-gpio, i2c-tiny-usb: address not acknowledged
    errno.EAGAIN: ArbitrationLost,  # designware
    errno.ETIMEDOUT: BusTimeout,
    errno.EBUSY: AddressInUse,
    errno.ENOENT: BusAbsent,
    errno.EACCES: BusAbsent,
    errno.EPERM: BusAbsent,
    errno.ENODEV: BusAbsent,
    errno.EBADF: PortClosed,
}


def from_os_error(error: OSError, where: str) -> HalError:
    """Translate an adapter's errno, once, into one of ours; what has no row is a `BusFault`.

    `where` names bus and address for the sentence. Source: Linux 6.1 I2C adapter drivers.
    """
    kind = _BY_ERRNO.get(error.errno or 0, BusFault)
    name = errno.errorcode.get(error.errno or 0, "unknown errno")
    return kind(f"{where}: {kind.__doc__.splitlines()[0].rstrip('.')} ({name})")  # type: ignore[union-attr]
