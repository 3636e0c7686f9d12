"""From the kernel's own text to the cause: each of them, on files as a Pi and a PC show them.

The files are written anew between two readings, as the kernel would have counted; what comes from
system calls (processor time, faults, the set of processors) is set beside them. The steps before
were on time: each computed 0.3 ms.
"""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import cast

import pytest
from msgspec.structs import replace

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, SECOND
from firmware_runtime.executive.blame import blamer as blamer_module
from firmware_runtime.executive.blame.blamer import Blamer
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.meters import BusMeter
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.executive.step import Late
from firmware_runtime.statistics.blame import ABOUT, CAUSES, NOT_MEASURED, BlameRow, Cause
from firmware_runtime.system.thread_counters import Reading, ThreadCounters
from tests.support import kernel_text as text
from tests.support.fake_machines import lay_out

STEPS = 100
"""On time, before the late one."""
USUAL = 300 * MICROSECOND


class Meter:
    """A bus: how long its devices had it, and attempts made again."""

    def __init__(self) -> None:
        self.retries = self.busy_ns = 0

    def addresses(self) -> list[int]:
        return [0x68]


class FakeMachine:
    """Counters of the kernel below a root of our own; system calls answer what is set here."""

    def __init__(self, root: Path, files: Mapping[str, str]) -> None:
        self._root = root
        self._counters = ThreadCounters(lay_out(root, files))
        self.cpu_ns = self.other_threads_ns = 0
        self.usage = (0, 0, 0, 0)
        self.allowed = frozenset({1})
        self.continued = 0
        self.is_fair = True
        self.supply = self._counters.supply
        self.is_traced = self._counters.is_traced
        self.close = self._counters.close

    def show(self, files: Mapping[str, str]) -> None:
        """Write these files again, into what is open already."""
        lay_out(self._root, files)

    def read(self) -> Reading:
        return self._counters.read()._replace(
            cpu_ns=self.cpu_ns,
            usage=self.usage,
            allowed=self.allowed,
            cpu=1,
            continued=self.continued,
            is_fair=self.is_fair,
            process_cpu_ns=self.cpu_ns + self.other_threads_ns,
        )


class Loop:
    """A blamer on such a machine, which has seen a quiet second."""

    def __init__(self, machine: FakeMachine) -> None:
        root = Coupled("root")
        for name in ("imu", "yaw"):
            root.add(Atomic(name))
        self.machine, self.meter, self.clock = machine, Meter(), MonotonicClock()
        profiler = Profiler(root, self.clock.now, Configuration())
        meters = [cast("BusMeter", self.meter)]
        self._blamer = Blamer(self.clock, profiler.accounting.accounts, meters)
        self._blamer.open(0)
        machine.cpu_ns += STEPS * USUAL
        self._blamer.keep(STEPS)

    def sleep(self) -> None:
        """The thread goes to sleep once more than the loop does."""
        self.machine.usage = (0, 0, 1, 0)

    def woken_late(self, by_ms: int = 12, at: int = 2 * SECOND) -> BlameRow:
        return self._explained(at, wake=by_ms * MILLISECOND)

    def ran_long(self, by_ms: int = 5, garbage: int = 0) -> BlameRow:
        return self._explained(2 * SECOND, step=by_ms * MILLISECOND + USUAL, garbage=garbage)

    def _explained(self, at: int, **parts: int) -> BlameRow:
        own_times, spent = (0, 5 * MILLISECOND), [(self.meter.busy_ns,)]
        on_time = Late(at, 0, 0, USUAL, USUAL, 0, at - 10 * MILLISECOND, own_times, spent)
        self.machine.cpu_ns += USUAL
        (row,) = self._blamer.explain([replace(on_time, steps=STEPS + 1, **parts)])
        return row

    def close(self) -> None:
        self._blamer.close()


def _make(monkeypatch: pytest.MonkeyPatch, root: Path, files: Mapping[str, str]) -> Iterator[Loop]:
    machine = FakeMachine(root, files)
    monkeypatch.setattr(blamer_module, "ThreadCounters", lambda: machine)
    monkeypatch.setattr(blamer_module, "fault_ns", lambda: 2 * MICROSECOND)
    loop = Loop(machine)
    yield loop
    loop.close()


@pytest.fixture
def pi(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Loop]:
    """A Pi with groups of version 2."""
    yield from _make(monkeypatch, tmp_path, text.RASPBERRY_PI)


@pytest.fixture
def pc(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Loop]:
    """A PC with groups of version 1, which keeps account of delays."""
    yield from _make(monkeypatch, tmp_path, text.PC)


def stopped(loop: Loop) -> BlameRow:
    loop.machine.continued = 1
    return loop.woken_late()


def garbage(loop: Loop) -> BlameRow:
    loop.machine.cpu_ns += 5 * MILLISECOND
    return loop.ran_long(garbage=4 * MILLISECOND)


def throttled(loop: Loop) -> BlameRow:
    loop.machine.show(text.throttled_for(79 * MILLISECOND) | text.waited(11 * MILLISECOND))
    return loop.woken_late()


def moved(loop: Loop) -> BlameRow:
    loop.machine.allowed = frozenset({0})
    loop.machine.show(text.waited(11 * MILLISECOND))
    return loop.woken_late()


def preempted(loop: Loop) -> BlameRow:
    loop.machine.show(text.waited(11 * MILLISECOND))
    return loop.woken_late()


def bus(loop: Loop) -> BlameRow:
    loop.sleep()
    loop.meter.retries, loop.meter.busy_ns = 2, 2 * MILLISECOND
    return loop.ran_long()


def faults(loop: Loop) -> BlameRow:
    loop.machine.usage = (2000, 0, 0, 0)
    loop.machine.cpu_ns += 5 * MILLISECOND
    return loop.ran_long()


def fetched_pages(loop: Loop) -> BlameRow:
    loop.machine.usage = (0, 90, 90, 0)
    loop.machine.cpu_ns += 1500 * MICROSECOND
    loop.machine.show(text.disk_worked(read_ms=3))
    return loop.ran_long()


def disk(loop: Loop) -> BlameRow:
    loop.sleep()
    loop.machine.show(text.wrote(1 << 20) | text.disk_worked(write_ms=2, flush_ms=2))
    return loop.ran_long()


def interrupts(loop: Loop) -> BlameRow:
    loop.machine.show(text.machine(irq=1, softirq=4, interrupts=60_000))
    return loop.woken_late()


def host(loop: Loop) -> BlameRow:
    loop.machine.show(text.machine(steal=2))
    return loop.woken_late()


def supply(loop: Loop) -> BlameRow:
    loop.machine.cpu_ns += 800 * MICROSECOND
    loop.machine.show({text.FLAGS: "50005\n"})
    return loop.ran_long(1)


def clock(loop: Loop) -> BlameRow:
    loop.machine.cpu_ns += 600 * MICROSECOND
    loop.machine.show(text.clock_at(600_000))
    return loop.ran_long(1)


def model(loop: Loop) -> BlameRow:
    loop.machine.cpu_ns += 5 * MILLISECOND
    return loop.ran_long()


def another_thread(loop: Loop) -> BlameRow:
    loop.machine.usage = (0, 0, 3, 0)
    loop.machine.other_threads_ns = 11 * MILLISECOND
    return loop.woken_late()


def asleep(loop: Loop) -> BlameRow:
    loop.sleep()
    return loop.ran_long()


def between(loop: Loop) -> BlameRow:
    loop.clock.overdue_at = 2 * SECOND - USUAL
    loop.machine.cpu_ns += 11 * MILLISECOND
    return loop.woken_late()


def host_in_a_step(loop: Loop) -> BlameRow:
    loop.machine.show(text.machine(steal=1))
    return loop.ran_long()


def unknown(loop: Loop) -> BlameRow:
    loop.machine.show(text.machine(steal=1, irq=1, softirq=1))
    return loop.woken_late()


HAPPENED: list[tuple[Cause, Callable[[Loop], BlameRow]]] = [
    (Cause.STOPPED, stopped),
    (Cause.GARBAGE, garbage),
    (Cause.THROTTLED, throttled),
    (Cause.MOVED, moved),
    (Cause.PREEMPTED, preempted),
    (Cause.BUS, bus),
    (Cause.FAULTS, faults),
    (Cause.FAULTS, fetched_pages),
    (Cause.DISK, disk),
    (Cause.INTERRUPTS, interrupts),
    (Cause.STOLEN, host),
    (Cause.SUPPLY, supply),
    (Cause.CLOCK, clock),
    (Cause.MODEL, model),
    (Cause.ANOTHER_THREAD, another_thread),
    (Cause.ASLEEP, asleep),
    (Cause.BETWEEN, between),
    (Cause.UNKNOWN, unknown),
    (Cause.UNKNOWN, host_in_a_step),
]


@pytest.mark.parametrize(("cause", "happens"), HAPPENED)
def test_what_a_pi_counts_makes_its_cause(
    pi: Loop, cause: Cause, happens: Callable[[Loop], BlameRow]
) -> None:
    assert named(happens(pi)) == cause


@pytest.mark.parametrize(
    ("cause", "happens"), [each for each in HAPPENED if each[0] is not Cause.SUPPLY]
)
def test_what_a_pc_counts_makes_its_cause(
    pc: Loop, cause: Cause, happens: Callable[[Loop], BlameRow]
) -> None:
    assert named(happens(pc)) == cause


def test_each_cause_is_there() -> None:
    assert {cause for cause, _ in HAPPENED} == set(ABOUT)


def test_a_group_above_that_is_held_back_holds_back_the_loop(pi: Loop) -> None:
    above = {text.ABOVE_2: text.throttled_for(79 * MILLISECOND)[text.GROUP_2]}
    pi.machine.show(above | text.waited(11 * MILLISECOND))
    assert named(pi.woken_late()) == Cause.THROTTLED


def test_a_loop_that_wakes_into_a_group_held_back_counts_as_asleep(pi: Loop) -> None:
    pi.machine.show(text.throttled_for(0, times=4))
    row = pi.woken_late(60)
    assert (named(row), row.throttlings) == (Cause.THROTTLED, 1)


def test_groups_hold_back_no_real_time_thread(pi: Loop) -> None:
    pi.machine.is_fair = False
    row = throttled(pi)
    assert (named(row), row.throttled_ns) == (Cause.PREEMPTED, 0)


def test_a_loop_that_was_put_into_another_group_is_judged_by_that(pi: Loop) -> None:
    other = "/sys/fs/cgroup/slow/cpu.stat"
    group = {text.MEMBERSHIP: "0::/slow\n", text.OWN_GROUPS: "0::/slow\n"}
    pi.machine.show(group | {other: text.throttled_for(0)[text.GROUP_2]} | text.waited(11_000_000))
    row = pi.woken_late()
    assert (named(row), row.throttled_ns) == (Cause.UNKNOWN, NOT_MEASURED)
    worked = {other: text.throttled_for(79 * MILLISECOND)[text.GROUP_2]}
    pi.machine.show(worked | text.waited(22 * MILLISECOND))
    assert named(pi.woken_late(at=3 * SECOND)) == Cause.THROTTLED


def test_a_pc_without_a_firmware_says_nothing_of_its_supply(pc: Loop) -> None:
    pc.machine.cpu_ns += 800 * MICROSECOND
    row = pc.ran_long(1)
    assert (named(row), row.supply) == (Cause.MODEL, NOT_MEASURED)


@pytest.mark.parametrize(("word", "bits"), [("0", 0), ("50000", 0), ("50005", 5), ("e0008", 8)])
def test_a_pis_word_counts_by_what_is_so_now(pi: Loop, word: str, bits: int) -> None:
    pi.machine.cpu_ns += 800 * MICROSECOND
    pi.machine.show({text.FLAGS: f"{word}\n"})
    row = pi.ran_long(1)
    assert (named(row), row.supply) == (Cause.SUPPLY if bits else Cause.MODEL, bits)


def test_the_kernels_account_of_delays_needs_no_byte(pc: Loop) -> None:
    pc.machine.show({text.STATUS: text.status(blocked=2)})
    row = pc.ran_long(15)
    assert (named(row), row.disk_wait_ns) == (Cause.DISK, 20 * MILLISECOND)


def named(row: BlameRow) -> str:
    return CAUSES[row.cause - 1]
