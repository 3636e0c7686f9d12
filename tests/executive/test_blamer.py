"""When counters are read, what is taken off them, and whose cause a late activation inherits."""

import errno
import mmap
import os
import signal
from collections.abc import Iterator
from itertools import accumulate, cycle
from typing import NoReturn
from unittest.mock import Mock

import pytest
from msgspec import structs

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, SECOND
from firmware_runtime.executive.blame import blamer as blamer_module
from firmware_runtime.executive.blame.blamer import GAP, Blamer
from firmware_runtime.executive.blame.late import Late
from firmware_runtime.executive.blame.usual import (
    LEAST_STEPS,
    OLD_STEPS,
    WAKE_NS,
    Grown,
    Quiet,
    beyond_usual,
)
from firmware_runtime.executive.clocks import MonotonicClock, ScaledClock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.late_steps import _blamer_for
from firmware_runtime.executive.ledger import BusMeter
from firmware_runtime.executive.profiler import Profiler
from firmware_runtime.statistics.blame import CAUSES, NOT_MEASURED, NOTHING, BlameRow, Cause
from firmware_runtime.system.machine_counters import CONTINUED
from firmware_runtime.system.thread_counters import Counted
from tests.support.counters import Counters


@pytest.fixture
def counters(monkeypatch: pytest.MonkeyPatch) -> Counters:
    stand_in = Counters()
    monkeypatch.setattr(blamer_module, "ThreadCounters", lambda: stand_in)
    return stand_in


@pytest.fixture
def blamer(counters: Counters) -> Iterator[Blamer]:
    """One that has seen a quiet second of 100 steps."""
    root = Coupled("root")
    root.add(Atomic("imu"))
    root.add(Atomic("yaw"))
    clock = MonotonicClock()
    profiler = Profiler(root, clock.now, Configuration())
    found = Blamer(clock, profiler.accounting.accounts, ())
    found.open(0)
    counters.pass_steps(100)
    found.keep(100)
    yield found
    found.close()


def late(at: int = 2 * SECOND, **parts: int) -> Late:
    usual, own_times = 300 * MICROSECOND, (0, 4 * MILLISECOND)
    nothing = Late(at, 0, 0, usual, usual, 0, at - 10 * MILLISECOND, own_times)
    return structs.replace(nothing, **parts)


def explained(blamer: Blamer, one: Late, steps: int) -> BlameRow:
    """The verdict on one step, after so many."""
    (row,) = blamer.explain([structs.replace(one, steps=steps)])
    return row


def cause(number: int) -> str:
    return CAUSES[number - 1]


def test_what_came_beyond_the_usual_is_blamed(blamer: Blamer, counters: Counters) -> None:
    counters.pass_steps(50)
    counters.run_delay_ns += 3 * MILLISECOND
    row = explained(blamer, late(wake=3200 * MICROSECOND), 150)
    assert cause(row.cause) == Cause.PREEMPTED
    assert (row.explained_ns, row.of_ns) == (3 * MILLISECOND, 3200 * MICROSECOND)
    assert row.throttled_ns == NOT_MEASURED


def test_what_is_usual_explains_nothing(blamer: Blamer, counters: Counters) -> None:
    counters.pass_steps(100)  # with 4 ms of run delay in all
    row = explained(blamer, late(wake=3 * MILLISECOND), 200)
    assert cause(row.cause) == Cause.UNKNOWN
    assert (row.run_delay_ns, row.cpu_ns, row.asleep_ns) == (0, 0, 3 * MILLISECOND)


def test_a_reading_after_a_late_one_is_what_the_next_is_compared_with(
    blamer: Blamer, counters: Counters
) -> None:
    counters.run_delay_ns += 3 * MILLISECOND
    explained(blamer, late(wake=3 * MILLISECOND), 101)
    row = explained(blamer, late(3 * SECOND, wake=3 * MILLISECOND), 102)
    assert cause(row.cause) == Cause.UNKNOWN


def test_a_long_step_is_its_slowest_models(blamer: Blamer, counters: Counters) -> None:
    counters.cpu_ns += 4 * MILLISECOND
    row = explained(blamer, late(step=4300 * MICROSECOND), 101)
    assert (cause(row.cause), row.culprit) == (Cause.MODEL, 1)


@pytest.mark.parametrize(("imu_ms", "slowest"), [(5, 1), (8, 1), (10, 0)])
def test_the_slowest_model_is_the_one_that_took_the_most_beyond_its_usual_time(
    blamer: Blamer, counters: Counters, imu_ms: int, slowest: int
) -> None:
    imu, _ = blamer._accounts
    imu.run = imu.reactions = 1
    for _ in range(2):
        imu.own_time.record(5 * MILLISECOND)
    step = (imu_ms + 4) * MILLISECOND
    counters.cpu_ns += step
    one = structs.replace(late(step=step), own_times=(imu_ms * MILLISECOND, 4 * MILLISECOND))
    row = explained(blamer, one, 101)
    assert (cause(row.cause), row.culprit) == (Cause.MODEL, slowest)


@pytest.mark.parametrize(("traced", "found"), [(False, Cause.ASLEEP), (True, Cause.UNKNOWN)])
def test_a_step_that_slept_while_a_tracer_had_it_is_not_called_asleep(
    blamer: Blamer, counters: Counters, found: Cause, *, traced: bool
) -> None:
    counters.pass_steps(1)
    counters.voluntary += 1
    counters.traced = traced
    assert cause(explained(blamer, late(step=50 * MILLISECOND), 101).cause) == found


def test_an_activation_behind_a_late_step_has_its_cause_and_costs_no_reading(
    blamer: Blamer, counters: Counters
) -> None:
    counters.cpu_ns += 12 * MILLISECOND
    first = explained(blamer, late(step=12 * MILLISECOND), 101)
    reads = counters.reads
    second = explained(
        blamer, late(2 * SECOND + MILLISECOND, behind=2 * MILLISECOND, previous_end=2 * SECOND), 102
    )
    assert counters.reads == reads
    assert (second.cause, second.culprit) == (first.cause, first.culprit)
    assert second.explained_ns == second.of_ns == 2 * MILLISECOND


def test_behind_a_step_that_was_not_judged_the_counters_are_read(
    blamer: Blamer, counters: Counters
) -> None:
    counters.cpu_ns += 5 * MILLISECOND
    row = explained(blamer, late(behind=5 * MILLISECOND, previous_end=SECOND), 101)
    assert (cause(row.cause), row.culprit) == (Cause.MODEL, NOT_MEASURED)


def test_a_loop_that_came_late_to_its_wait_was_busy_between_the_steps(
    blamer: Blamer, counters: Counters
) -> None:
    assert blamer._clock is not None
    blamer._clock.overdue_at = 1_998_700_000
    counters.cpu_ns += 4 * MILLISECOND
    row = explained(blamer, late(wake=3200 * MICROSECOND), 101)  # from 1_996_500_000 on
    assert (cause(row.cause), row.explained_ns) == (Cause.BETWEEN, 2_200_000)


def test_readings_keep_apart_however_often_the_loop_is_late(
    blamer: Blamer, counters: Counters
) -> None:
    explained(blamer, late(wake=3 * MILLISECOND), 101)
    reads = counters.reads
    row = explained(blamer, late(2 * SECOND + GAP - 1, wake=3 * MILLISECOND), 102)
    assert counters.reads == reads
    assert (cause(row.cause), row.run_delay_ns) == (Cause.UNKNOWN, NOT_MEASURED)


@pytest.mark.parametrize("clock", [VirtualClock(), ScaledClock(2)])
def test_only_real_time_is_judged(clock: VirtualClock | ScaledClock) -> None:
    assert _blamer_for(clock, [], ()) is None
    assert isinstance(_blamer_for(MonotonicClock(), [], ()), Blamer)


def test_a_run_that_is_over_has_its_counters_closed(blamer: Blamer, counters: Counters) -> None:
    blamer.close()
    assert counters.reads == -1
    assert explained(blamer, late(wake=SECOND), 1) == NOTHING


def test_that_the_process_goes_on_after_a_stop_is_counted_while_counters_are_open(
    blamer: Blamer,
) -> None:
    os.kill(os.getpid(), signal.SIGCONT)
    assert CONTINUED.times == 1
    blamer.close()
    assert CONTINUED.times is None


def test_states_and_throttling_have_no_usual_amount() -> None:
    found = Grown(Counted(throttled_ns=5, continued=1, khz=7, cpu_ns=10), 10, 0)
    quiet = Grown(Counted(throttled_ns=5, continued=1, khz=7, cpu_ns=20), 10, 0)
    counted = beyond_usual(found, quiet).counted
    assert (counted.throttled_ns, counted.continued, counted.khz, counted.cpu_ns) == (5, 1, 7, 0)


def test_a_quiet_time_without_a_step_says_nothing_and_one_of_a_single_step_something() -> None:
    found = Grown(Counted(cpu_ns=10), 2, 3)
    quiet = Grown(Counted(cpu_ns=4), 0, 1)
    assert beyond_usual(found, quiet) == found
    beyond = beyond_usual(found, quiet._replace(steps=1))
    assert (beyond.counted.cpu_ns, beyond.retries) == (2, 1)


def test_a_quieter_time_says_what_is_usual_until_it_is_old(blamer: Blamer) -> None:
    assert blamer._before is not None
    mark = blamer._before

    def quiet(first: int, steps: int, slow_ns: int) -> Quiet:
        after = mark._replace(steps=first + steps)
        return Quiet(mark._replace(steps=first), after, slow_ns)

    calm, busy = quiet(0, 100, 0), quiet(100, 100, 5 * MILLISECOND)
    assert calm.is_to_replace(None)
    assert calm.is_to_replace(busy)
    assert not busy.is_to_replace(calm)
    assert quiet(100 + OLD_STEPS, 100, 5 * MILLISECOND).is_to_replace(calm)
    assert quiet(100, 100, 0).is_to_replace(calm)
    assert not quiet(100, LEAST_STEPS - 1, 0).is_to_replace(calm)
    start = quiet(0, 13, 0)
    assert quiet(13, 90, MILLISECOND).is_to_replace(start)
    assert not quiet(13, 25, MILLISECOND).is_to_replace(start)


def test_a_bus_is_blamed_for_what_it_took_of_this_step_beyond_the_mean(counters: Counters) -> None:
    root = Coupled("root")
    root.add(Atomic("imu"))
    clock = MonotonicClock()
    profiler = Profiler(root, clock.now, Configuration())
    meter = Mock(spec=BusMeter, retries=0, busy_ns=102 * MILLISECOND)
    meter.addresses.return_value = [0x40, 0x68]
    one = structs.replace(
        late(step=3300 * MICROSECOND), own_times=(0,), spent=[(MILLISECOND, 2 * MILLISECOND)]
    )
    found = Blamer(clock, profiler.accounting.accounts, [meter])
    found.open(0)
    counters.pass_steps(100)
    found.keep(100)
    counters.pass_steps(2)
    counters.voluntary = 1
    row = explained(found, one, 102)
    found.close()
    assert (cause(row.cause), row.culprit) == (Cause.BUS, 0x68)
    assert (row.explained_ns, row.of_ns) == (2 * MILLISECOND, 3 * MILLISECOND)


@pytest.mark.parametrize(("spent", "culprit"), [((0, 0), NOT_MEASURED), ((0, 1), 0x68)])
def test_a_bus_that_had_to_ask_again_names_no_device_that_it_was_not_used_for(
    counters: Counters, spent: tuple[int, int], culprit: int
) -> None:
    """If none, it asked one beyond those that have a place of their own."""
    root = Coupled("root")
    root.add(Atomic("imu"))
    clock = MonotonicClock()
    profiler = Profiler(root, clock.now, Configuration())
    meter = Mock(spec=BusMeter, retries=0, busy_ns=0)
    meter.addresses.return_value = [0x40, 0x68]
    found = Blamer(clock, profiler.accounting.accounts, [meter])
    found.open(0)
    meter.retries = 1
    counters.pass_steps(1)
    counters.voluntary = 1
    one = structs.replace(late(step=3300 * MICROSECOND), own_times=(0,), spent=[spent])
    row = explained(found, one, 1)
    found.close()
    assert (cause(row.cause), row.culprit) == (Cause.BUS, culprit)


def test_before_the_first_quiet_second_all_that_was_counted_is_evidence(counters: Counters) -> None:
    root = Coupled("root")
    root.add(Atomic("imu"))
    clock = MonotonicClock()
    found = Blamer(clock, Profiler(root, clock.now, Configuration()).accounting.accounts, ())
    found.open(0)
    counters.run_delay_ns += 3 * MILLISECOND
    row = explained(found, structs.replace(late(wake=3200 * MICROSECOND), own_times=(0,)), 1)
    found.close()
    assert (cause(row.cause), row.explained_ns) == (Cause.PREEMPTED, 3 * MILLISECOND)
    assert row.others_ns == 0


def test_a_single_quiet_step_says_what_work_is_usual_for_a_clock_that_is_held_down(
    counters: Counters, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = Coupled("root")
    root.add(Atomic("imu"))
    clock = MonotonicClock()
    found = Blamer(clock, Profiler(root, clock.now, Configuration()).accounting.accounts, ())
    found.open(0)
    counters.pass_steps(1)
    found.keep(1)
    counters.pass_steps(4)  # the same work at a quarter of the clock
    monkeypatch.setattr(counters, "supply", lambda: 1)
    row = explained(found, structs.replace(late(step=1200 * MICROSECOND), own_times=(0,)), 2)
    found.close()
    assert (cause(row.cause), row.explained_ns) == (Cause.SUPPLY, 900 * MICROSECOND)


@pytest.mark.parametrize(("first", "second", "found"), [(20_000, 4_000, 1_000), (100, 5_000, 0)])
def test_a_page_costs_what_its_first_touch_takes_beyond_its_second(
    monkeypatch: pytest.MonkeyPatch, first: int, second: int, found: int
) -> None:
    instants = accumulate(cycle([0, first, 0, second]))
    monkeypatch.setattr(blamer_module, "thread_time_ns", lambda: next(instants))
    monkeypatch.setattr(blamer_module, "PAGES", 16)
    assert blamer_module.fault_ns.__wrapped__() == found


def test_a_page_costs_its_part_of_what_a_usual_batch_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    prices = iter((2_000, 9_000, 3_000, 1_000, 7_000))

    def touch(memory: mmap.mmap) -> int:
        return next(prices) * len(range(0, len(memory), mmap.PAGESIZE))

    monkeypatch.setattr(blamer_module, "_first_touch", touch)
    assert blamer_module.fault_ns.__wrapped__() == 3_000


def test_where_memory_is_refused_a_page_costs_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_descriptor: int, _size: int) -> NoReturn:
        raise OSError(errno.ENOMEM, "no memory")

    monkeypatch.setattr(mmap, "mmap", refuse)
    assert blamer_module.fault_ns.__wrapped__() == 0


def test_each_page_that_was_fetched_or_made_has_its_price(
    blamer: Blamer, counters: Counters, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(blamer_module, "fault_ns", lambda: 10 * MICROSECOND)
    counters.minor_faults, counters.major_faults = 30, 5
    counters.cpu_ns += 4 * MILLISECOND
    assert explained(blamer, late(step=4 * MILLISECOND), 101).faults_ns == 350 * MICROSECOND


def test_what_slow_steps_took_may_be_theirs_until_counters_are_read(
    blamer: Blamer, counters: Counters
) -> None:
    counters.run_delay_ns += 3 * MILLISECOND
    blamer.pass_over(2 * MILLISECOND)
    slow = late(wake=3200 * MICROSECOND, beyond=2 * MILLISECOND)
    row = explained(blamer, slow, 101)  # what it took beyond the usual is none of others
    assert (cause(row.cause), row.others_ns) == (Cause.UNKNOWN, 2 * MILLISECOND)
    counters.run_delay_ns += 3 * MILLISECOND
    row = explained(blamer, late(3 * SECOND, wake=3200 * MICROSECOND), 102)
    assert (cause(row.cause), row.others_ns) == (Cause.PREEMPTED, 0)


def test_waking_up_belongs_to_what_was_slept_for() -> None:
    before = Counted(run_delay_ns=4 * MILLISECOND, voluntary=200)
    quiet = Grown(before, 100, 0)
    pages = Counted(run_delay_ns=1400 * MICROSECOND, voluntary=40)
    assert beyond_usual(Grown(pages, 1, 0), quiet).counted.run_delay_ns == 600 * MICROSECOND
    slow = Grown(structs.replace(before, run_delay_ns=80 * MILLISECOND), 100, 0)
    dear = structs.replace(pages, run_delay_ns=10 * MILLISECOND)
    found = beyond_usual(Grown(dear, 1, 0), slow).counted.run_delay_ns
    assert found == 10 * MILLISECOND - 800 * MICROSECOND - 38 * WAKE_NS
    prompt = Grown(Counted(run_delay_ns=0, voluntary=1), 1, 0)
    assert beyond_usual(Grown(pages, 1, 0), prompt).counted.run_delay_ns == 1400 * MICROSECOND


def test_of_steps_that_one_reading_covers_the_first_is_judged_and_less_what_the_others_took(
    blamer: Blamer, counters: Counters
) -> None:
    counters.run_delay_ns += 5 * MILLISECOND
    first = late(wake=3 * MILLISECOND)
    later = late(2 * SECOND + 3 * MILLISECOND, wake=2 * MILLISECOND, beyond=MILLISECOND)
    reads = counters.reads
    rows = blamer.explain([structs.replace(each, steps=102) for each in (first, later)])
    assert counters.reads == reads + 1
    assert [cause(row.cause) for row in rows] == [Cause.PREEMPTED, Cause.UNKNOWN]
    assert [row.others_ns for row in rows] == [MILLISECOND, NOT_MEASURED]
