"""Calls of the C library that Python has no words for, with its errors as OSError.

The calls are too short to give the interpreter's lock away for them (`ctypes.PyDLL`): a thread that
computes would keep it for milliseconds. No call hands over a callback, so a process whose memory
may not become executable (systemd's MemoryDenyWriteExecute) can make them.
"""

import ctypes
import os

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
