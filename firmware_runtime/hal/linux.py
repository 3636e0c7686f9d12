"""Linux reality: an I2C bus as `/dev/i2c-N`, through smbus2 and nothing but its `i2c_rdwr`.

`i2c_rdwr` (ioctl I2C_RDWR) carries the address in every message, so nothing is remembered between
transactions, takes more than 32 bytes, and sends repeated STARTs. It has two gaps, closed here:

- the kernel does not check whether one of its own drivers holds the address; so the address is
  claimed by I2C_SLAVE, which does check and sends nothing, before its first transaction;
- the adapter waits a second for a stuck bus by default; so `open_i2c` sets a shorter timeout, which
  holds for every program on that bus; the kernel's own is back when the bus is closed. Too short a
  one is no use: a late interrupt of a transfer that was given up has crashed bcm2835's driver.

Every errno is translated once, here, into the errors of `firmware_runtime.hal.wire_errors`.
Adapters differ: bcm2835 refuses a read that is not the last message: that arrives as a BusFault.
Sources: Linux 6.1 drivers/i2c/i2c-dev.c, busses/i2c-bcm2835.c; smbus2 0.6.1.
"""

import errno
import os
import threading
from collections.abc import Sequence
from contextlib import suppress
from fcntl import LOCK_EX, LOCK_NB, flock, ioctl
from pathlib import Path
from typing import Final

from smbus2 import I2cFunc, SMBus, i2c_msg

from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import (
    AddressInUse,
    BusAbsent,
    BusInUse,
    PortClosed,
    from_os_error,
)

I2C_SLAVE: Final = 0x0703
I2C_TIMEOUT: Final = 0x0702
I2C_TIMEOUT_UNIT_MS: Final = 10
KERNEL_TIMEOUT_MS: Final = 1000


def open_i2c(
    name: str, path_or_number: str | int, *, timeout_ms: int = 100, alone: bool = False
) -> "LinuxI2cBus":
    """Open a bus by its number or by the path of its device node.

    `name` is what errors call it. `timeout_ms`, in whole tens, bounds each transaction on a stuck
    bus; it is the adapter's, so it holds for every program that uses this bus.
    With `alone` no other that opens it so gets the bus while it is open (flock: advisory).
    Raises BusAbsent if the node is not there, may not be opened, or is no plain I2C bus; BusInUse.
    """
    is_number = isinstance(path_or_number, int)
    path = f"/dev/i2c-{path_or_number}" if is_number else str(path_or_number)
    port = SMBus()
    try:
        port.open(path)
        _demand_plain_transfers(port)
        if alone:
            _keep_others_out(port)
        _bound_waiting(port, timeout_ms)
    except BlockingIOError as error:
        port.close()
        raise BusInUse(
            f"{path} is driven by another process, expected none; end that one", where=name
        ) from error
    except OSError as error:
        port.close()
        raise BusAbsent(f"{path} {_what_to_do(error)}", where=name) from error
    return LinuxI2cBus(name, port)


class LinuxI2cBus(I2cBus):
    """A bus of the Linux kernel; one lock, so that no transfer meets a descriptor being closed."""

    def __init__(self, name: str, port: SMBus) -> None:
        self.name = name
        self._port = port
        self._lock = threading.Lock()
        self._claimed: set[int] = set()

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        """Carry out one transaction as one I2C_RDWR call; return what was read, in order, joined.

        Raises NoAcknowledge, ArbitrationLost, BusTimeout, BusFault, AddressInUse or PortClosed.
        """
        parts = [
            i2c_msg.read(address, message)
            if isinstance(message, int)
            else i2c_msg.write(address, message)
            for message in messages
        ]
        with self._lock:
            if address not in self._claimed:
                self._claim(address)
            try:
                self._port.i2c_rdwr(*parts)
            except OSError as error:
                raise from_os_error(error, self._where(address)) from error
        reads = zip(parts, messages, strict=True)
        return b"".join(bytes(part) for part, message in reads if isinstance(message, int))

    def close(self) -> None:
        """Close the device node, after the transfer under way if there is one.

        The adapter has the kernel's timeout again, unless another process drives the bus.
        """
        with self._lock:
            self._claimed.clear()
            with suppress(OSError):
                _keep_others_out(self._port)
                _bound_waiting(self._port, KERNEL_TIMEOUT_MS)
            self._port.close()

    def _claim(self, address: int) -> None:
        """Make sure the bus is open and no kernel driver holds the address."""
        descriptor = self._port.fd
        if descriptor is None:
            raise PortClosed("the bus is closed", where=self._where(address), expected="it open")
        try:
            ioctl(descriptor, I2C_SLAVE, address)
        except OSError as error:
            if error.errno != errno.EBUSY:
                raise from_os_error(error, self._where(address)) from error
            raise AddressInUse(
                "a kernel driver holds the address, expected it free; unbind the "
                "driver or remove its device (delete_device, or its dtoverlay)",
                where=self._where(address),
            ) from error
        self._claimed.add(address)

    def _where(self, address: int) -> str:
        return f"{self.name} address 0x{address:02x}"


def _demand_plain_transfers(port: SMBus) -> None:
    if not port.funcs & I2cFunc.I2C:
        raise OSError(errno.EOPNOTSUPP, "no plain I2C transfers")


def _bound_waiting(port: SMBus, timeout_ms: int) -> None:
    """Set the adapter's timeout."""
    if port.fd is not None:
        ioctl(port.fd, I2C_TIMEOUT, -(-timeout_ms // I2C_TIMEOUT_UNIT_MS))


def _keep_others_out(port: SMBus) -> None:
    if port.fd is not None:
        flock(port.fd, LOCK_EX | LOCK_NB)


def _what_to_do(error: OSError) -> str:
    """Return what is wrong with a device node, and its fix, as one sentence."""
    if error.errno == errno.ENOENT:
        found = ", ".join(sorted(map(str, Path("/dev").glob("i2c-*")))) or "none"
        return (
            f"does not exist (this machine has {found}); enable the I2C controller, load the "
            "module i2c-dev, or name another bus"
        )
    if error.errno in (errno.EACCES, errno.EPERM):
        return (
            "may not be opened by this user; add the user to the group of the device (i2c): "
            "sudo usermod -aG i2c $USER, then log in again"
        )
    if error.errno == errno.ENOTTY:
        return "is not an I2C bus; name another bus"
    if error.errno == errno.EOPNOTSUPP:
        return (
            "does not say that it can do plain I2C transfers: it is another kind of bus, or its "
            "adapter does not answer; name another bus, or repair the adapter"
        )
    return f"cannot be opened ({error.strerror}); name another bus"


def check_node(name: str, path: str) -> None:
    """Open a bus or port and close it again, which moves nothing on its wires. Raises BusAbsent."""
    try:
        os.close(os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC))
    except OSError as error:
        raise BusAbsent(
            f"{path} cannot be opened ({error.strerror})",
            where=name,
            expected="a device node that this process may read and write",
        ) from error
