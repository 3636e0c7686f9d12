"""Linux reality: a serial port as `/dev/tty...`, through pyserial.

Reads do not block. A write waits no longer than its time-out, and only when the output buffer of
some 4000 bytes is full, which is a port that stopped sending. The port is opened for one program
alone: flock, which is advisory, so it keeps out a second program of ours or any that asks.

An adapter that is unplugged may come back under the same path, such as an alias of udev's: after a
failure the path is opened again by the next use.

Every failure of pyserial is translated once, here, into the errors of
`firmware_runtime.hal.wire_errors`. Parity, stop bits and flow control are left at 8N1 without any.
Source: pyserial 3.5, serialposix.
"""

import errno
import os
import termios
from contextlib import suppress
from pathlib import Path
from select import select
from time import monotonic
from typing import Final

from serial import PortNotOpenError, Serial

from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import BusAbsent, BusFault, BusTimeout, HalError, PortClosed

MOST_AT_ONCE: Final = 4096
"""Bytes taken by one read: what a Linux terminal can hold."""
CANDIDATES: Final = ("ttyAMA*", "ttyS*", "ttyUSB*", "ttyACM*", "serial*")


def open_serial(
    name: str, path: str, baud: int = 9600, *, write_timeout_ms: int = 20, alone: bool = True
) -> "LinuxSerialPort":
    """Open a port by the path of its device node; what waited in its input buffer is thrown away.

    `name` is what errors call it. Unless `alone`, a program that has the port does not keep us out.
    `write_timeout_ms` bounds a write to a port that stopped sending.
    Raises BusAbsent if it is not there, may not be opened, is in use or cannot have that rate.
    """
    return LinuxSerialPort(name, path, baud, write_timeout_ms=write_timeout_ms, alone=alone)


class LinuxSerialPort(SerialPort):
    """A serial port of the Linux kernel, ours alone while it is open."""

    def __init__(
        self, name: str, path: str, baud: int, *, write_timeout_ms: int, alone: bool
    ) -> None:
        self.name = name
        self._path = path
        self._baud = baud
        self._write_timeout_s = write_timeout_ms / 1000
        self._alone = alone
        self._has_failed = False
        self._port = self._opened()

    def write(self, data: bytes) -> None:
        """Hand all bytes to the kernel; raises BusTimeout, BusFault or PortClosed."""
        try:
            port = self._usable().fileno()
            left, give_up_at = memoryview(data), monotonic() + self._write_timeout_s
            # Not by pyserial, which has a time-out also where all were taken, but late.
            while left := self._not_taken(port, left):
                if not select((), (port,), (), max(0.0, give_up_at - monotonic()))[1]:
                    raise TimeoutError
        except OSError as error:
            raise self._translated(error, "write", f"{len(data)} bytes to be taken") from error

    def read_available(self) -> bytes:
        """Take what has arrived, 4096 bytes at most; raises BusFault or PortClosed."""
        try:
            return self._usable().read(MOST_AT_ONCE)
        except OSError as error:
            raise self._translated(error, "read", "bytes or none") from error

    def discard_input(self) -> None:
        """Empty the kernel's input buffers; raises BusFault or PortClosed."""
        try:
            self._usable().reset_input_buffer()
        except (OSError, termios.error) as error:
            raise self._translated(error, "flush", "the input buffer emptied") from error

    def close(self) -> None:
        """Close the device node and give up the lock; closing twice is harmless."""
        self._has_failed = False
        self._port.close()

    def _opened(self) -> Serial:
        """The open port. Raises BusAbsent."""
        try:
            return Serial(
                self._path,
                self._baud,
                timeout=0,
                exclusive=self._alone,
            )
        except (OSError, ValueError, OverflowError, termios.error) as error:
            what = _what_to_do(error, self._baud)
            raise BusAbsent(f"{self._path} {what}", where=self.name) from error

    def _usable(self) -> Serial:
        """The port; after a failure it is opened again: the adapter may have come back.

        Raises BusAbsent if it has not, which is an OSError as those of pyserial are.
        """
        if self._has_failed:
            self._port.close()
            self._port = self._opened()
            self._has_failed = False
        return self._port

    @staticmethod
    def _not_taken(port: int, data: memoryview) -> memoryview:
        """Write as much as there is room for; the rest."""
        with suppress(BlockingIOError):
            return data[os.write(port, data) :]
        return data

    def _translated(self, error: Exception, action: str, expected: str) -> HalError:
        where = f"{self.name}: {self._port.port}"
        if isinstance(error, PortNotOpenError):
            return PortClosed(f"{where} {action} after it was closed", expected="it open")
        if isinstance(error, TimeoutError):
            return BusTimeout(
                f"{where} {action} timed out, expected {expected}; it stopped sending"
            )
        self._has_failed = True
        return BusFault(
            f"{where} {action} failed, expected {expected}; unplugged, or read by another program"
        )


def _what_to_do(error: Exception, baud: int) -> str:
    """Return what is wrong with a port, and its fix, as one sentence."""
    number = error.errno if isinstance(error, OSError) else None
    if number == errno.ENOENT:
        found = ", ".join(
            sorted({str(each) for kind in CANDIDATES for each in Path("/dev").glob(kind)})
        )
        return f"does not exist (this machine has {found or 'none'}); name another port"
    if number in (errno.EACCES, errno.EPERM):
        return "may not be opened by this user; add the user to the group of the device (dialout)"
    if number in (errno.EAGAIN, errno.EBUSY):
        return "is in use by another program, expected it free; end that program"
    if isinstance(error, ValueError | OverflowError):
        return f"cannot be set to {baud} baud; name another rate"
    return "cannot be opened as a serial port; name another port"
