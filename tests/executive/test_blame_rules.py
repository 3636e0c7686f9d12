"""Each rule, on what counters grew by in runs in which the cause was known."""

import pytest
from msgspec import structs

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.blame.rules import ENOUGH, RULES, Evidence, verdict
from firmware_runtime.statistics.blame import ABOUT, Cause

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
    (Cause.DISK, structs.replace(LONG, cpu_ns=677_044, written_bytes=1_766_287)),
    (Cause.DISK, structs.replace(LONG, cpu_ns=677_044, disk_wait_ns=4 * MILLISECOND)),
    (Cause.ASLEEP, structs.replace(LONG, cpu_ns=100_000)),
    (Cause.CLOCK, structs.replace(LONG, cpu_ns=4_900_000, khz_before=1_800_000, khz=600_000)),
    (Cause.SUPPLY, structs.replace(LONG, cpu_ns=4_900_000, khz=600_000, supply=1)),
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


def test_what_is_not_measured_explains_nothing() -> None:
    blind = Evidence(of_ns=LATE.of_ns)
    assert verdict(blind).cause is Cause.UNKNOWN
    assert blind.asleep_ns is None
    assert verdict(structs.replace(blind, stops=1)).cause is Cause.UNKNOWN


def test_one_tick_of_the_host_or_two_of_interrupts_may_have_come_by_chance() -> None:
    assert verdict(structs.replace(LATE, stolen_ns=10 * MILLISECOND)).cause is Cause.UNKNOWN
    assert verdict(structs.replace(LATE, interrupt_ns=20 * MILLISECOND)).cause is Cause.UNKNOWN


def test_a_collection_that_lost_its_processor_is_not_blamed_for_that() -> None:
    lost = structs.replace(LONG, garbage_ns=4_500_000, run_delay_ns=4_000_000, cpu_ns=500_000)
    assert verdict(lost).cause is Cause.PREEMPTED


def test_a_clock_that_stayed_makes_it_the_model() -> None:
    steady = structs.replace(LONG, cpu_ns=4_900_000, khz_before=600_000, khz=600_000)
    assert verdict(steady).cause is Cause.MODEL


@pytest.mark.parametrize(
    ("cause", "culprit"),
    [(Cause.MODEL, 2), (Cause.ASLEEP, 2), (Cause.DISK, 2), (Cause.BUS, 0x68), (Cause.MOVED, -1)],
)
def test_it_names_the_part_of_the_robot_that_it_is(cause: Cause, culprit: int) -> None:
    evidence = next(each for named, each in RECORDED if named is cause)
    assert verdict(evidence).culprit == culprit
