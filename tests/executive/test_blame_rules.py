"""Each rule, on what counters grew by; and what a run leaves of the causes."""

from collections.abc import Callable, Sequence
from unittest.mock import Mock

import pytest
from msgspec import structs

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.blame.rules import ENOUGH, RULES, Evidence, verdict
from firmware_runtime.executive.clocks import MonotonicClock, S
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.statistics.blame import ABOUT, CAUSES, NOT_MEASURED, Cause
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot
from tests.support.stalling_clock import StallingClock

LATE = Evidence(
    of_ns=10_726_030,
    cpu_ns=0,
    run_delay_ns=0,
    throttled_ns=0,
    stolen_ns=0,
    interrupt_ns=0,
    stops=0,
    read_bytes=0,
    written_bytes=0,
    model=2,
    device=0x68,
)
"""Nothing but the lateness."""
LONG = structs.replace(LATE, of_ns=5_000_000, in_step_ns=4_940_000)
"""The same of a step that took long."""
RECORDED: list[tuple[Cause, Evidence]] = [
    (Cause.PREEMPTED, structs.replace(LATE, run_delay_ns=10_669_458, cpu_ns=518_335)),
    (Cause.MOVED, structs.replace(LATE, run_delay_ns=9_599_187, was_moved=True, from_cpu=1)),
    (
        Cause.THROTTLED,
        structs.replace(LATE, run_delay_ns=9_352_588, throttled_ns=79_012_220),
    ),
    (Cause.STOPPED, structs.replace(LATE, stops=1, cpu_ns=501_770)),
    (Cause.STOLEN, structs.replace(LATE, stolen_ns=20 * MILLISECOND)),
    (Cause.INTERRUPTS, structs.replace(LATE, interrupt_ns=30 * MILLISECOND)),
    (Cause.BETWEEN, structs.replace(LATE, cpu_ns=9_900_000, before_wait_ns=10_000_000)),
    (Cause.MODEL, structs.replace(LONG, cpu_ns=4_033_943)),
    (Cause.GARBAGE, structs.replace(LONG, cpu_ns=4_500_000, garbage_ns=4_300_000)),
    (Cause.BUS, structs.replace(LONG, bus_ns=4_200_000, retries=2)),
    (Cause.FAULTS, structs.replace(LONG, cpu_ns=4_136_750, faults_ns=4_100_000)),
    (Cause.FAULTS, structs.replace(LONG, cpu_ns=2_317_150, major_faults=91, read_bytes=372_736)),
    (
        Cause.FAULTS,
        structs.replace(
            LONG,
            of_ns=4_125_689,
            cpu_ns=1_713_446,
            faults_ns=125_088,
            major_faults=48,
            voluntary=47,
            disks_ns=MILLISECOND,
        ),
    ),
    (
        Cause.DISK,
        structs.replace(LONG, cpu_ns=677_044, written_bytes=1_766_287, disks_ns=4 * MILLISECOND),
    ),
    (Cause.DISK, structs.replace(LONG, cpu_ns=677_044, disk_wait_ns=4 * MILLISECOND)),
    (
        Cause.ANOTHER_THREAD,
        structs.replace(
            LATE, of_ns=5_150_745, cpu_ns=496_498, voluntary=4, other_threads_ns=8_222_871
        ),
    ),
    (Cause.ASLEEP, structs.replace(LONG, cpu_ns=100_000)),
    (
        Cause.CLOCK,
        structs.replace(
            LONG, cpu_ns=4_900_000, usual_cpu_ns=2_500_000, khz_before=1_800_000, khz=600_000
        ),
    ),
    (Cause.SUPPLY, structs.replace(LONG, cpu_ns=4_900_000, usual_cpu_ns=1_700_000, supply=1)),
    (Cause.UNKNOWN, LATE),
]


@pytest.mark.parametrize(("cause", "evidence"), RECORDED)
def test_evidence_makes_its_cause(cause: Cause, evidence: Evidence) -> None:
    assert verdict(evidence).cause is cause


def test_every_cause_has_a_rule_a_sentence_and_a_record() -> None:
    ruled = {cause for cause, _ in RULES}
    assert ruled == set(Cause) - {Cause.UNKNOWN} == {each for each, _ in RECORDED} - {Cause.UNKNOWN}
    assert set(ABOUT) == set(Cause)


@pytest.mark.parametrize(("cause", "evidence"), RECORDED)
def test_no_cause_explains_more_than_there_was(cause: Cause, evidence: Evidence) -> None:
    found = verdict(evidence)
    assert found.explained_ns <= evidence.of_ns
    assert found.explained_ns >= ENOUGH * evidence.of_ns or cause is Cause.UNKNOWN


def test_less_than_enough_is_unknown_rather_than_a_guess() -> None:
    short = round(ENOUGH * LATE.of_ns)
    assert verdict(structs.replace(LATE, run_delay_ns=short + 1)).cause is Cause.PREEMPTED
    assert verdict(structs.replace(LATE, run_delay_ns=short - 1)).cause is Cause.UNKNOWN


@pytest.mark.parametrize("of_ns", [0, 1, LATE.of_ns])
def test_what_is_not_measured_or_did_not_grow_explains_nothing(of_ns: int) -> None:
    assert named(LATE, of_ns=of_ns) is Cause.UNKNOWN
    blind = Evidence(of_ns=of_ns)
    assert verdict(blind).cause is Cause.UNKNOWN
    assert blind.asleep_ns is None
    assert verdict(structs.replace(blind, stops=1)).cause is Cause.UNKNOWN
    regrouped = structs.replace(LATE, run_delay_ns=LATE.of_ns, was_regrouped=True)
    assert named(regrouped, of_ns=of_ns) is Cause.UNKNOWN


def test_one_tick_of_the_host_or_two_of_interrupts_may_have_come_by_chance() -> None:
    assert verdict(structs.replace(LATE, stolen_ns=10 * MILLISECOND)).cause is Cause.UNKNOWN
    assert verdict(structs.replace(LATE, interrupt_ns=20 * MILLISECOND)).cause is Cause.UNKNOWN
    certain = verdict(structs.replace(LATE, interrupt_ns=40 * MILLISECOND))
    assert certain.explained_ns == LATE.of_ns


def test_a_collection_that_lost_its_processor_is_not_blamed_for_that() -> None:
    lost = structs.replace(LONG, garbage_ns=4_500_000, run_delay_ns=4_000_000, cpu_ns=500_000)
    assert verdict(lost).cause is Cause.PREEMPTED


def test_a_clock_that_stayed_makes_it_the_model() -> None:
    steady = structs.replace(LONG, cpu_ns=4_900_000, khz_before=600_000, khz=600_000)
    assert verdict(steady).cause is Cause.MODEL


def test_another_thread_is_blamed_only_for_what_the_loop_slept_as_the_lock_makes_it() -> None:
    waited = next(each for named, each in RECORDED if named is Cause.ANOTHER_THREAD)
    assert named(waited, voluntary=1) is Cause.UNKNOWN
    assert named(waited, voluntary=2) is Cause.ANOTHER_THREAD
    assert named(waited, other_threads_ns=2_000_000) is Cause.UNKNOWN
    assert named(waited, of_ns=4_300_000) is Cause.UNKNOWN
    assert named(waited, run_delay_ns=4_000_000) is Cause.PREEMPTED
    assert named(waited, run_delay_ns=None) is Cause.UNKNOWN


@pytest.mark.parametrize(
    ("cause", "culprit"),
    [
        *[(Cause.MODEL, 2), (Cause.ASLEEP, 2), (Cause.DISK, 2), (Cause.BUS, 0x68)],
        *[(Cause.MOVED, NOT_MEASURED), (Cause.UNKNOWN, NOT_MEASURED)],
    ],
)
def test_it_names_the_part_of_the_robot_that_it_is(cause: Cause, culprit: int) -> None:
    evidence = next(each for named, each in RECORDED if named is cause)
    assert verdict(evidence).culprit == culprit


def named(evidence: Evidence, **parts: int | None) -> Cause:
    return verdict(structs.replace(evidence, **parts)).cause


def test_a_clock_or_a_supply_explains_no_more_than_it_makes_the_usual_work_longer() -> None:
    computed = structs.replace(LONG, cpu_ns=4_900_000, usual_cpu_ns=300_000)
    assert named(computed, khz_before=1_800_000, khz=600_000) is Cause.MODEL
    assert named(computed, khz_before=3_000_000, khz=2_500_000) is Cause.MODEL
    assert named(computed, supply=1) is Cause.MODEL
    assert named(computed, usual_cpu_ns=1_000_000, khz_before=1_800_000, khz=600_000) is Cause.MODEL


def test_what_slow_steps_before_it_may_have_had_of_a_counter_explains_nothing() -> None:
    taken = structs.replace(LATE, run_delay_ns=10_669_458)
    assert named(taken, others_ns=4_000_000) is Cause.PREEMPTED
    assert named(taken, others_ns=5_000_000) is Cause.UNKNOWN
    assert named(LATE, stops=1, others_ns=50_000_000) is Cause.STOPPED


def test_a_group_that_was_held_back_while_the_loop_ran_is_no_cause() -> None:
    computed = structs.replace(LONG, cpu_ns=4_500_000, throttled_ns=79_012_220)
    assert named(computed) is Cause.MODEL
    assert named(computed, cpu_ns=0, run_delay_ns=4_500_000) is Cause.THROTTLED
    assert named(LATE, throttled_ns=79_012_220, run_delay_ns=None) is Cause.THROTTLED


def test_bytes_without_a_busy_disk_are_not_waited_for() -> None:
    logged = structs.replace(LONG, cpu_ns=100_000, written_bytes=4096)
    assert named(logged, disks_ns=0) is Cause.ASLEEP
    assert named(logged, disks_ns=None) is Cause.UNKNOWN
    assert named(logged, disks_ns=2 * MILLISECOND) is Cause.DISK
    assert named(logged, disks_ns=MILLISECOND, voluntary=40) is Cause.DISK


def test_one_fetched_page_is_no_reason_for_a_long_sleep() -> None:
    fetched = structs.replace(LONG, cpu_ns=100_000, major_faults=1, voluntary=1)
    assert named(fetched, disks_ns=MILLISECOND) is Cause.ASLEEP
    assert named(fetched, disks_ns=4 * MILLISECOND) is Cause.FAULTS


def test_between_a_model_and_faults_that_may_be_dear_nothing_is_named() -> None:
    dear = structs.replace(LONG, cpu_ns=4_474_684)
    assert named(dear, faults_ns=1_864_800) is Cause.UNKNOWN
    assert named(dear, faults_ns=1_000_000) is Cause.UNKNOWN
    assert named(dear, faults_ns=100_000) is Cause.MODEL


def test_what_a_host_took_is_a_part_of_the_time_that_nothing_else_has() -> None:
    stolen = 30 * MILLISECOND
    assert named(LATE, stolen_ns=stolen) is Cause.STOLEN
    assert named(LONG, stolen_ns=stolen, cpu_ns=4_500_000) is Cause.MODEL
    assert named(LATE, interrupt_ns=5 * stolen, run_delay_ns=10_000_000) is Cause.PREEMPTED


def test_a_bus_explains_only_what_the_step_was_asleep() -> None:
    busy = structs.replace(LONG, bus_ns=14_780_056)
    assert named(busy, cpu_ns=500_000) is Cause.BUS
    assert named(busy, cpu_ns=4_500_000) is Cause.MODEL
    assert named(busy, in_step_ns=200_000) is Cause.UNKNOWN
    assert named(busy, run_delay_ns=None) is Cause.BUS


def test_faults_explain_nothing_before_the_step() -> None:
    faulty = structs.replace(LATE, cpu_ns=10_000_000, faults_ns=10_000_000)
    assert named(faulty) is Cause.UNKNOWN
    waited = verdict(structs.replace(faulty, before_wait_ns=10_500_000))
    assert (waited.cause, waited.explained_ns) == (Cause.FAULTS, 10_000_000)


def test_a_long_sleep_after_the_deadline_is_a_quotas_if_one_was_used_up() -> None:
    woken = structs.replace(LATE, of_ns=60_000_000, throttlings=1)
    assert named(woken) is Cause.THROTTLED
    assert named(woken, throttlings=0) is Cause.UNKNOWN
    assert named(woken, of_ns=20_000_000) is Cause.UNKNOWN
    assert named(woken, stolen_ns=50_000_000) is Cause.STOLEN
    assert named(woken, in_step_ns=55_000_000) is Cause.ASLEEP


def test_who_did_not_go_to_sleep_was_not_asleep() -> None:
    stolen = structs.replace(LONG, may_have_slept=False)
    assert named(stolen) is Cause.UNKNOWN
    assert named(stolen, written_bytes=4096, disks_ns=8 * MILLISECOND) is Cause.UNKNOWN
    assert named(stolen, bus_ns=5 * MILLISECOND) is Cause.UNKNOWN
    assert named(stolen, stops=1) is Cause.STOPPED


def test_what_waited_for_its_processor_was_not_asleep() -> None:
    waited = structs.replace(LONG, cpu_ns=500_000, run_delay_ns=2_500_000)
    assert waited.asleep_ns == 2_000_000
    assert structs.replace(waited, cpu_ns=LONG.of_ns).asleep_ns == 0
    assert named(waited) is Cause.UNKNOWN


def test_what_a_tracer_has_may_have_been_halted_by_it() -> None:
    assert named(LONG) is Cause.ASLEEP
    traced = structs.replace(LONG, is_traced=True)
    assert named(traced) is Cause.UNKNOWN
    assert named(traced, written_bytes=4096, disks_ns=8 * MILLISECOND) is Cause.UNKNOWN
    assert named(traced, stops=1) is Cause.STOPPED
    assert named(traced, cpu_ns=LONG.of_ns) is Cause.MODEL


class QuickClock(MonotonicClock):
    """Real time by its kind; a wait is over at once, the 30th much too late."""

    def __init__(self) -> None:
        super().__init__()
        self.waits = 0

    def source(self) -> tuple[Callable[[], int], int]:
        return self.now, 0  # it starts anew with each wait

    def wait(self, until: int, sources: Sequence[S]) -> list[S]:  # noqa: ARG002
        self.waits += 1
        self.start(until + 50 * MILLISECOND * (self.waits == 30))
        return []


def test_a_late_step_has_a_verdict_and_is_counted_by_its_cause() -> None:
    run = Run(Robot(), QuickClock())
    run.until(60 * PERIOD)
    figures = run.figures()
    worst = figures.worst[0]
    assert worst.lateness_us >= 50_000
    assert worst.blame is not None
    assert worst.blame.cause in CAUSES
    assert worst.blame.of_us >= 50_000
    counted = figures.late_by_cause
    assert counted is not None
    assert counted[worst.blame.cause] >= 1


def test_what_was_on_time_has_none() -> None:
    run = Run(Robot(), QuickClock())
    run.until(20 * PERIOD)
    on_time = [each for each in run.figures().worst if each.lateness_us + each.step_us < 1000]
    assert on_time
    assert all(each.blame is None for each in on_time)


def test_a_clock_that_is_not_the_machines_has_no_causes() -> None:
    run = Run(Robot(), StallingClock({5: 25 * MILLISECOND}))
    run.until(SECOND)
    assert run.figures().late_by_cause == {}
    assert all("blame" not in each for each in run.json()["worst"])


def test_where_no_counters_are_read_a_late_step_is_among_the_worst_at_once() -> None:
    robot, found = Robot(), list[float]()
    policies = {"imu": ActivationPolicy("catch-up")}
    run = Run(robot, StallingClock({10: 35 * MILLISECOND}), Configuration(policies=policies))
    robot.imu.work = lambda number: (
        found.append(run.figures().worst[0].lateness_us) if number == 11 else None
    )
    run.until(SECOND)
    assert found == [35_000]  # as the next is late, too, and no time is left to it


def counters_of(run: Run) -> object:
    """What its blamer has open."""
    blamer = run.executive._ledger.late._blamer
    assert blamer is not None
    return blamer._counters


def test_what_a_run_takes_to_begin_is_no_usual_steps_time() -> None:
    tap = Mock(instrument=lambda _, functions: functions)
    tap.exit = lambda exit_models: exit_models()
    run = Run(Robot(), QuickClock(), Configuration(tap=tap))
    opened = []
    tap.go_on = lambda _: opened.append(counters_of(run))
    run.executive.run_on(20 * PERIOD)
    run.executive.run_on(40 * PERIOD)
    run.executive.end()
    assert opened == [None, None]


@pytest.mark.parametrize("pauses", [(), (20, 40)])
def test_counters_are_closed_at_every_pause_and_opened_again(pauses: tuple[int, ...]) -> None:
    run = Run(Robot(), QuickClock())
    for steps in pauses:
        run.executive.run_on(steps * PERIOD)
        assert counters_of(run) is None
    run.executive.run_on(60 * PERIOD)
    run.executive.end()
    assert counters_of(run) is None
    assert run.figures().worst[0].blame is not None
