"""Calls of the C library that Python has no words for, with its errors as OSError.

The calls are too short to give the interpreter's lock away for them (`ctypes.PyDLL`): a thread that
computes would keep it for milliseconds. No call hands over a callback, so a process whose memory
may not become executable (systemd's MemoryDenyWriteExecute) can make them.

An alarm is a timer of the kernel that `select` can wait for. The timeout of `select` itself is a
float, and relative: what passes between reading the clock and the kernel's taking over comes on
top. The alarm takes whole nanoseconds and the instant itself.

Source: timerfd_create(2). Python has it from 3.13 on only.
"""

import ctypes
import os
import weakref

from firmware_runtime.devs.time import SECOND

LIBRARY = ctypes.PyDLL(None, use_errno=True)


def call(function: str, *arguments: int) -> int:
    """Call a function that takes integers. Raises OSError with its errno."""
    result: int = getattr(LIBRARY, function)(*(ctypes.c_ulong(each) for each in arguments))
    if result < 0:
        raise error()
    return result


def error() -> OSError:
    """The error of the call just made."""
    code = ctypes.get_errno()
    return OSError(code, os.strerror(code))


_CLOCK_MONOTONIC = 1
_TFD_CLOEXEC, _TFD_NONBLOCK, _TFD_TIMER_ABSTIME = 0o2000000, 0o4000, 1


class Alarm:
    """A descriptor that is readable from the instant set last, until another one is set."""

    def __init__(self) -> None:
        self._descriptor = call("timerfd_create", _CLOCK_MONOTONIC, _TFD_CLOEXEC | _TFD_NONBLOCK)
        weakref.finalize(self, os.close, self._descriptor)
        self._setting = (ctypes.c_long * 4)()  # interval and instant, each in s and ns
        self._settime = LIBRARY.timerfd_settime
        # prepared once: the call is made before every wait
        self._arguments = (self._descriptor, _TFD_TIMER_ABSTIME, ctypes.byref(self._setting), None)

    def set(self, at: int) -> None:
        """Ring at an instant, in ns, and not before. One that has passed rings at once."""
        self._setting[2], self._setting[3] = divmod(at, SECOND)
        if self._settime(*self._arguments) < 0:
            raise error()

    def fileno(self) -> int:
        """The descriptor."""
        return self._descriptor
