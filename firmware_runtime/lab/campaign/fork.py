"""Work in a child of this process, which is as this process is now, and gives one row back.

The child has all that was computed before, and costs what it changes. It shares no file that is
written: what it has to say goes through a pipe. It may take so much processor time and no more, so
that one that hangs is found on a busy machine as on an idle one.
"""

import gc
import os
import resource
import signal
import warnings
from collections.abc import Callable
from typing import Final, TypeVar

import msgspec

from firmware_runtime.system.signals import signal_name

T = TypeVar("T")

CPU_S: Final = 60
"""Processor time of a child, s; a run of the robot takes a hundredth of it."""
HANG: Final = "it used all of its processor time"


def in_child(work: Callable[[], T]) -> T | str:
    """Return what `work` makes in a child, in JSON's types, or how the child died, in words."""
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        # other threads of this process hold nothing that the child takes
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        _be_child(work, writing)
    os.close(writing)
    with open(reading, "rb") as answers:  # noqa: PTH123 -- a descriptor
        answer = answers.read()
    _, status = os.waitpid(child, 0)
    code = os.waitstatus_to_exitcode(status)
    if code == 0:
        made: T = msgspec.json.decode(answer)
        return made
    if -code in {signal.SIGXCPU, signal.SIGKILL}:
        return HANG
    return f"its process ended by {signal_name(-code)}" if code < 0 else f"it ended with {code}"


def _be_child(work: Callable[[], object], writing: int) -> None:
    """Work, answer, and end without all that an interpreter does at its end."""
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
