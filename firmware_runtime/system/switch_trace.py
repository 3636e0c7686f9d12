"""Trace of switches by the kernel: the thread each processor ran, and when one could have run.

An instance of tracing of our own (`instances/firmware-runtime-PID`), so that no other tracing is
touched: switches of all processors, wakings of one thread, stamped by CLOCK_MONOTONIC, in rings
that are overwritten. It takes the right to tracefs, root's as a rule; where none is mounted it is
mounted for this process alone. The instance goes at the end, and those of processes that were
killed go at the next start.

Source: Linux Documentation/trace/ftrace.rst and events.rst.
"""

import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.system.c_library import LIBRARY, call, error

PLACES = (Path("/sys/kernel/tracing"), Path("/sys/kernel/debug/tracing"))
_PREFIX = "firmware-runtime-"
_RING_KIB = 4096
_CLONE_NEWNS, _MS_REC_PRIVATE = 0x20000, 0x44000
_LINE = re.compile(r"\[(\d+)\]\s+\S+\s+(\d+)\.(\d{6}): (sched_switch|sched_waking): (.*)")
_SWITCH = re.compile(
    r"prev_comm=(.*) prev_pid=(\d+) prev_prio=(-?\d+) prev_state=(\S+)"
    r" ==> next_comm=(.*) next_pid=(\d+) next_prio=(-?\d+)"
)


class NoTracingError(FirmwareRuntimeError):
    """The kernel may not be asked, or cannot say; a sentence says why."""


class Thread(NamedTuple):
    """A thread as the kernel's tracing has it; `priority` as in `sched_switch`, 0 to 139."""

    name: str
    pid: int
    priority: int


class Switch(NamedTuple):
    """A processor goes from one thread to another, at an instant of CLOCK_MONOTONIC, ns.

    `still_could` says whether the one that goes could have run on. Without `to` it is the waking of
    the traced thread, which can run from then on.
    """

    at: int
    cpu: int
    still_could: bool = False
    before: Thread | None = None
    to: Thread | None = None


@contextmanager
def switch_trace(pid: int) -> Iterator["SwitchTrace"]:
    """Trace while the block lasts, wakings of thread `pid` only. Raises NoTracingError."""
    root = _tracefs()
    _remove_left_over(root)
    instance = root / "instances" / f"{_PREFIX}{os.getpid()}"
    try:
        instance.mkdir()
    except OSError as fault:
        raise _refused(instance, fault) from fault
    try:
        _switch_on(instance, pid)
        yield SwitchTrace(instance)
    except OSError as fault:
        raise _refused(instance, fault) from fault
    finally:
        _remove(instance)


class SwitchTrace:
    """The rings of one instance."""

    def __init__(self, instance: Path) -> None:
        self._trace = instance / "trace"

    def read(self) -> list[Switch]:
        """Return what they hold, oldest first; some MB of text on a busy machine."""
        with self._trace.open(encoding="utf-8", errors="replace") as lines:
            return switches(lines)


def switches(lines: Iterable[str]) -> list[Switch]:
    """The switches and wakings in the text of a trace; other lines are left out."""
    found = (_switch(match) for line in lines if (match := _LINE.search(line)))
    return [each for each in found if each is not None]


def _switch(line: "re.Match[str]") -> Switch | None:
    cpu, whole, micro, event, rest = line.groups()
    at = (int(whole) * 1_000_000 + int(micro)) * 1000
    if event == "sched_waking":
        return Switch(at, int(cpu))
    match = _SWITCH.match(rest)
    if match is None:
        return None
    name, pid, priority, state, next_name, next_pid, next_priority = match.groups()
    return Switch(
        at,
        int(cpu),
        state.startswith("R"),
        Thread(name, int(pid), int(priority)),
        Thread(next_name, int(next_pid), int(next_priority)),
    )


def _switch_on(instance: Path, pid: int) -> None:
    events = instance / "events" / "sched"
    for path, text in (
        (instance / "trace_clock", "mono"),
        (instance / "buffer_size_kb", str(_RING_KIB)),
        (events / "sched_waking" / "filter", f"pid == {pid}"),
        (events / "sched_waking" / "enable", "1"),
        (events / "sched_switch" / "enable", "1"),
        (instance / "tracing_on", "1"),
    ):
        path.write_text(text)


def _remove(instance: Path) -> None:
    """Switch off and remove; the kernel refuses while any process has a file of it open."""
    with suppress(OSError):
        (instance / "events" / "enable").write_text("0")
    with suppress(OSError):
        instance.rmdir()


def _remove_left_over(root: Path) -> None:
    with suppress(OSError):
        for each in (root / "instances").glob(f"{_PREFIX}*"):
            pid = each.name.removeprefix(_PREFIX)
            if pid.isdecimal() and not Path(f"/proc/{pid}").exists():
                _remove(each)


def _tracefs() -> Path:
    """Return where tracefs is mounted, if it is; else mounted here.

    Where no other process sees it.
    """
    for place in PLACES:
        with suppress(OSError):
            if (place / "instances").is_dir():
                return place
    place = PLACES[0]
    try:
        call("unshare", _CLONE_NEWNS)
        _mount(b"none", b"/", None, _MS_REC_PRIVATE)
        _mount(b"tracefs", os.fsencode(place), b"tracefs", 0)
    except OSError as fault:
        raise _refused(place, fault) from fault
    return place


def _mount(source: bytes, target: bytes, kind: bytes | None, flags: int) -> None:
    if LIBRARY.mount(source, target, kind, flags, None) < 0:
        raise error()


def _refused(place: Path, fault: OSError) -> NoTracingError:
    return NoTracingError(
        f"the kernel's tracing cannot be used ({fault.strerror})",
        where=place,
        expected="root, or tracefs that this user may write",
    )
