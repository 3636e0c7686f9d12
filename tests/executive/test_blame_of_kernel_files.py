"""From the kernel's own text to the cause: each of them, on files as a Pi and a PC show them.

The files are written anew between two readings, as the kernel would have counted; what comes from
system calls (processor time, faults, the set of processors) is set beside them. The steps before
were on time: each computed 0.3 ms.
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple, cast

import pytest
from msgspec.structs import replace

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, SECOND
from firmware_runtime.executive.blame import blamer as blamer_module
from firmware_runtime.executive.blame.blamer import Blamer
from firmware_runtime.executive.blame.late import Late
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.ledger import BusMeter
from firmware_runtime.executive.profiler import Profiler
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


class Happened(NamedTuple):
    """What the kernel counted until the loop woke late, or had run long by so many ms."""

    cause: Cause
    ran_long_ms: int = 0
    files: Mapping[str, str] = {}
    cpu_us: int = 0
    sleeps: bool = False
    garbage_ms: int = 0
    set: Mapping[str, object] = {}

    def to(self, loop: Loop) -> BlameRow:
        """Let it happen."""
        if self.sleeps:
            loop.sleep()
        for name, value in self.set.items():
            owner, _, attribute = name.partition(".")
            setattr(getattr(loop, owner), attribute, value)
        loop.machine.cpu_ns += self.cpu_us * MICROSECOND
        loop.machine.show(self.files)
        if not self.ran_long_ms:
            return loop.woken_late()
        return loop.ran_long(self.ran_long_ms, garbage=self.garbage_ms * MILLISECOND)


WAITED = text.waited(11 * MILLISECOND)
ANOTHER = {"machine.usage": (0, 0, 3, 0), "machine.other_threads_ns": 11 * MILLISECOND}
CARRIED = {"meter.retries": 2, "meter.busy_ns": 2 * MILLISECOND}
THROTTLED = Happened(Cause.THROTTLED, files=text.throttled_for(79 * MILLISECOND) | WAITED)
HAPPENED = [
    Happened(Cause.STOPPED, set={"machine.continued": 1}),
    Happened(Cause.GARBAGE, 5, cpu_us=5000, garbage_ms=4),
    THROTTLED,
    Happened(Cause.MOVED, files=WAITED, set={"machine.allowed": frozenset({0})}),
    Happened(Cause.PREEMPTED, files=WAITED),
    Happened(Cause.BUS, 5, sleeps=True, set=CARRIED),
    Happened(Cause.FAULTS, 5, cpu_us=5000, set={"machine.usage": (2000, 0, 0, 0)}),
    Happened(
        *(Cause.FAULTS, 5, text.disk_worked(read_ms=3), 1500),
        set={"machine.usage": (0, 90, 90, 0)},
    ),
    Happened(
        *(Cause.DISK, 5, text.wrote(1 << 20) | text.disk_worked(write_ms=2, flush_ms=2)),
        sleeps=True,
    ),
    Happened(Cause.INTERRUPTS, files=text.machine(irq=1, softirq=4, interrupts=60_000)),
    Happened(Cause.STOLEN, files=text.machine(steal=2)),
    Happened(Cause.SUPPLY, 1, {text.FLAGS: "50005\n"}, 800),
    Happened(Cause.CLOCK, 1, text.clock_at(600_000), 600),
    Happened(Cause.MODEL, 5, cpu_us=5000),
    Happened(Cause.ANOTHER_THREAD, set=ANOTHER),
    Happened(Cause.ASLEEP, 5, sleeps=True),
    Happened(Cause.BETWEEN, cpu_us=11_000, set={"clock.overdue_at": 2 * SECOND - USUAL}),
    Happened(Cause.UNKNOWN, files=text.machine(steal=1, irq=1, softirq=1)),
    Happened(Cause.UNKNOWN, 5, text.machine(steal=1)),
]


@pytest.mark.parametrize("happened", HAPPENED, ids=lambda happened: str(happened.cause))
@pytest.mark.parametrize("where", ["pi", "pc"])
def test_what_is_counted_makes_its_cause(
    request: pytest.FixtureRequest, where: str, happened: Happened
) -> None:
    if (where, happened.cause) != ("pc", Cause.SUPPLY):  # which has no such firmware
        assert named(happened.to(request.getfixturevalue(where))) == happened.cause


def test_each_cause_is_there() -> None:
    assert {each.cause for each in HAPPENED} == set(ABOUT)


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
    row = THROTTLED.to(pi)
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
