"""What a run asks of the operating system, and what it got: never silently missing.

Each setting is requested, read back where the system allows it, and reported as a
`Request`. After the run everything is as it was before. What holds is among the run's conditions.

Sources: sched(7), mlockall(2), prctl(2), Linux Documentation/power/pm_qos_interface.rst.
"""

import gc
import os
import struct
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

from msgspec import Struct, to_builtins

from firmware_runtime.devs.time import MICROSECOND
from firmware_runtime.executive.clocks import Clock, MonotonicClock
from firmware_runtime.statistics.file_header import (
    NOT_ASKED,
    NOTHING_TO_WAIT_FOR,
    SETTINGS,
    Request,
    Settings,
)
from firmware_runtime.system.conditions import system_conditions
from firmware_runtime.system.this_system import IS_LINUX, NAME

CPU_DMA_LATENCY = Path("/dev/cpu_dma_latency")
_MCL_CURRENT, _MCL_FUTURE, _MCL_ONFAULT = 1, 2, 4
_PR_SET_TIMERSLACK, _PR_GET_TIMERSLACK = 29, 30


class ProcessSettings(Struct, frozen=True):
    """What to ask for; the defaults ask for nothing."""

    fifo_priority: int = 0
    """SCHED_FIFO at this priority, 1 to 99: whatever has a lower one waits while the loop runs."""
    lock_memory: bool = False
    """Keep in RAM what has been touched once, now or later: no step waits for a page again."""
    cpus: tuple[int, ...] = ()
    """Run on these processors only."""
    timer_slack_ns: int = 0
    """How much later than asked the kernel may wake us; 50 us unless set, and none under FIFO."""
    freeze_garbage: bool = False
    """Exempt what exists at the start from garbage collection; collect between steps only."""
    spin_us: float = 0.0
    """Poll the clock for so long before a deadline, instead of sleeping up to it."""
    keep_cpu_awake: bool = False
    """Hold /dev/cpu_dma_latency at 0: no processor sleeps so deeply that waking takes long."""


def holds_priority() -> bool:
    """Whether this process comes before ordinary ones."""
    return IS_LINUX and os.sched_getscheduler(0) in {os.SCHED_FIFO, os.SCHED_RR}


def give_up_priority() -> None:
    """Be an ordinary process from now on, whatever was granted; that is never refused."""
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def run_conditions(
    clock: Clock, granted: Settings, stated: Mapping[str, object]
) -> dict[str, object]:
    """Those of a run: its clock, the system's, the settings requested, and what else is stated."""
    settings = to_builtins(granted)
    return {"clock": type(clock).__name__, **system_conditions(), SETTINGS: settings, **stated}


class _Refusal(Exception):
    """The system accepted the request, but did something else."""


@contextmanager
def in_force(settings: ProcessSettings, clock: Clock) -> Iterator[Settings]:
    """Within the block, the settings hold as far as they were granted; yields what was."""
    with ExitStack() as undo:
        yield {name: _ask(name, getattr(settings, name), clock, undo) for name in _REQUESTS}


def _ask(name: str, asked: object, clock: Clock, undo: ExitStack) -> Request:
    def answer(reason: str | None) -> Request:
        wish = list(asked) if isinstance(asked, tuple) else asked  # as JSON has it
        return Request(wish, reason is None, reason)

    if asked == getattr(_NOTHING, name):
        return answer(NOT_ASKED)
    if not isinstance(clock, MonotonicClock):
        return answer(NOTHING_TO_WAIT_FOR)
    request, needs = _REQUESTS[name]
    if name in _OF_LINUX and not IS_LINUX:
        return answer(f"{NAME} has no such setting")
    try:
        request(asked, clock, undo)
    except PermissionError as error:
        return answer(f"{error.strerror}; needs {needs}")
    except (OSError, ValueError, OverflowError, _Refusal) as error:
        return answer(str(error))
    return answer(None)


def _afterwards(undo: ExitStack, function: Callable[..., object], *arguments: object) -> None:
    """Put something back when the run is over; what the system then refuses stays as it is."""

    def put_back() -> None:
        with suppress(OSError):
            function(*arguments)

    undo.callback(put_back)


def call(function: str, *arguments: int) -> int:
    """Call the C library, which virtual time does not load. Raises OSError."""
    from firmware_runtime.system.c_library import call as called  # noqa: PLC0415

    return called(function, *arguments)


def _timer_slack(slack_ns: int, _clock: MonotonicClock, undo: ExitStack) -> None:
    before = call("prctl", _PR_GET_TIMERSLACK, 0, 0, 0, 0)
    call("prctl", _PR_SET_TIMERSLACK, slack_ns, 0, 0, 0)
    _afterwards(undo, call, "prctl", _PR_SET_TIMERSLACK, before, 0, 0, 0)
    held = call("prctl", _PR_GET_TIMERSLACK, 0, 0, 0, 0)
    if held > slack_ns:
        raise _Refusal(f"the kernel keeps {held} ns")


def _fifo(priority: int, _clock: MonotonicClock, undo: ExitStack) -> None:
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    _afterwards(undo, os.sched_setscheduler, 0, *before)
    if os.sched_getscheduler(0) != os.SCHED_FIFO:
        raise _Refusal("the kernel kept another scheduling class")


def _cpus(cpus: tuple[int, ...], _clock: MonotonicClock, undo: ExitStack) -> None:
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, cpus)
    _afterwards(undo, os.sched_setaffinity, 0, before)
    held = os.sched_getaffinity(0)
    if held != set(cpus):
        raise _Refusal(f"the kernel allows {sorted(held)} of them")


def _memory(_asked: bool, _clock: MonotonicClock, undo: ExitStack) -> None:  # noqa: FBT001
    # what is touched stays; what libraries reserve and never touch need not be in RAM at all
    call("mlockall", _MCL_CURRENT | _MCL_FUTURE | _MCL_ONFAULT)
    _afterwards(undo, call, "munlockall")


def _cpu_awake(_asked: bool, _clock: MonotonicClock, undo: ExitStack) -> None:  # noqa: FBT001
    descriptor = os.open(CPU_DMA_LATENCY, os.O_WRONLY | os.O_CLOEXEC)
    undo.callback(os.close, descriptor)  # closing ends the request
    os.write(descriptor, struct.pack("=i", 0))


def _spin(spin_us: float, clock: MonotonicClock, undo: ExitStack) -> None:
    before, clock.spin = clock.spin, round(spin_us * MICROSECOND)
    undo.callback(setattr, clock, "spin", before)


def _garbage(_asked: bool, _clock: MonotonicClock, undo: ExitStack) -> None:  # noqa: FBT001
    if gc.isenabled():
        undo.callback(gc.enable)
    undo.callback(gc.unfreeze)
    gc.collect()
    gc.freeze()
    gc.disable()


_NOTHING = ProcessSettings()
_REQUESTS: dict[str, tuple[Callable[[Any, MonotonicClock, ExitStack], None], str]] = {
    # slack before FIFO: leaving FIFO resets the slack, so it is put back after that
    "timer_slack_ns": (_timer_slack, "nothing special"),
    "fifo_priority": (_fifo, "CAP_SYS_NICE, or LimitRTPRIO= of the unit"),
    "lock_memory": (_memory, "CAP_IPC_LOCK, or LimitMEMLOCK= of the unit"),
    "cpus": (_cpus, "processors the unit may use"),
    "keep_cpu_awake": (_cpu_awake, f"write access to {CPU_DMA_LATENCY}"),
    "spin_us": (_spin, "nothing special"),
    "freeze_garbage": (_garbage, "nothing special"),
}
_OF_LINUX = _REQUESTS.keys() - {"spin_us", "freeze_garbage"}
