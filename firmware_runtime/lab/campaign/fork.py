"""Work in a child of this process, which is as this process is now, and gives one row back.

The child has all that was computed before, and costs what it changes. It shares no file that is
written: what it has to say goes through a pipe. It may take so much processor time and no more, so
that one that hangs is found on a busy machine as on an idle one. One that sleeps takes none: it is
ended once it has neither used any nor been kept from it for a minute, where the system shows that.
"""

import gc
import os
import resource
import signal
import warnings
from collections.abc import Callable
from contextlib import suppress
from select import POLLIN, poll
from time import monotonic
from typing import Final, TypeVar

import msgspec

from firmware_runtime.system.signals import signal_name
from firmware_runtime.system.this_process import time_used

T = TypeVar("T")

CPU_S: Final = 60
"""Processor time of a child, s; a run of the robot takes a hundredth of it."""
HANG: Final = "it used all of its processor time"
STILL_S: Final = 60.0
"""How long a child may sleep, s of the machine's clock: nothing in virtual time waits."""
STILL: Final = "it waited for what did not come, and used no processor time"
HANGS: Final = (HANG, STILL)
_LOOK_MS: Final = 1000
_SIGN_OF_LIFE: Final = b" "
"""Goes ahead of an answer in JSON, and is none of it."""
_answering: int | None = None
"""The pipe of this process, where it is a child."""


def in_child(work: Callable[[], T]) -> T | str:
    """Return what `work` makes in a child, in JSON's types, or how the child died, in words."""
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        # other threads of this process hold nothing that the child takes
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        os.close(reading)
        _be_child(work, writing)
    os.close(writing)
    try:
        answer, status, used_s, is_still = _answer_of(child, reading)
    finally:
        os.close(reading)
    code = os.waitstatus_to_exitcode(status)
    if code == 0:
        made: T = msgspec.json.decode(answer)
        return made
    if is_still:
        return STILL
    if -code == signal.SIGXCPU or (-code == signal.SIGKILL and used_s >= CPU_S):
        return HANG
    return f"its process ended by {signal_name(-code)}" if code < 0 else f"it ended with {code}"


def _answer_of(child: int, reading: int) -> tuple[bytes, int, float, bool]:
    """Wait for a child: its answer, its status, the processor time it used, s, and if it slept.

    What it has started may hold the pipe longer than it lives; the answer is there by then.
    """
    answer, status = bytearray(), None
    lived_at, used, is_still = monotonic(), time_used(child), False
    poller = poll()
    poller.register(reading, POLLIN)
    while True:
        if poller.poll(_LOOK_MS):
            if not (part := os.read(reading, 1 << 16)):
                break
            answer += part
            lived_at = monotonic()
            continue
        _live()
        if status is not None:
            break
        ended, code, usage = os.wait4(child, os.WNOHANG)
        if ended == child:
            status = code
            continue
        before, used = used, time_used(child)
        if used is None or used != before:
            lived_at = monotonic()
        elif monotonic() - lived_at >= STILL_S and not is_still:
            is_still = True
            os.kill(child, signal.SIGKILL)  # it is there until it has been waited for
    if status is None:
        _, status, usage = os.wait4(child, 0)
    return bytes(answer), status, usage.ru_utime + usage.ru_stime, is_still


def _live() -> None:
    """Show a sign of life to the process that waits for this one, which waits no longer than so."""
    if _answering is not None:
        with suppress(OSError):
            os.write(_answering, _SIGN_OF_LIFE)


def _be_child(work: Callable[[], object], writing: int) -> None:
    """Work, answer, and end without all that an interpreter does at its end."""
    global _answering  # noqa: PLW0603 -- of a process of its own
    _answering = writing
    try:
        gc.disable()
        for each in (signal.SIGINT, signal.SIGTERM, signal.SIGXCPU):
            signal.signal(each, signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S + 1))
        answer = msgspec.json.encode(work())
        with open(writing, "wb") as out:
            out.write(answer)
        os._exit(0)
    except BaseException:  # noqa: BLE001 -- whatever it is, this is not the parent
        os._exit(1)
