"""Two sources of one quantity: when they agree, when they do not, and when they do again."""

import math

import pytest
from msgspec.structs import replace

from firmware_runtime.devs.time import SECOND
from firmware_runtime.models.cross_check import (
    CrossCheck,
    CrossCheckSettings,
    Source,
    Standstill,
    Window,
    _at_most,
)
from tests.support.atomic_bench import AtomicBench

SETTINGS = CrossCheckSettings(
    quantity="heading", windows=(Window(2 * SECOND, 0.5),), share=0.1, circle=math.tau
)


def same(value: float) -> float:
    return value


class Bench(AtomicBench):
    """A quantity that turns at `true` rad/s; the rate's source says something else."""

    def __init__(self, settings: CrossCheckSettings = SETTINGS) -> None:
        super().__init__(CrossCheck("check", settings, Source(float, same), Source(float, same)))

    def turn(self, begin_ms: int, end_ms: int, *, true: float, said: float) -> None:
        for at in range(begin_ms, end_ms, 10):
            heading = math.remainder(true * (at - begin_ms) / 1000, math.tau)
            self.put(at, rate=said, value=heading)


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.mark.parametrize("rate", [0.0, 0.3, -3.0, 40.0])
def test_sources_that_say_the_same_agree_round_the_circle(bench: Bench, rate: float) -> None:
    bench.turn(0, 5000, true=rate, said=1.05 * rate + 0.05)
    bench.run(5000)
    assert bench.said.get("fault", []) == []
    assert bench.said.get("agrees", []) == []


@pytest.mark.parametrize(
    ("true", "said"), [(1.0, 0.0), (0.0, 1.0), (1.0, -1.0), (3.0, 6.0), (0.1, 0.8)]
)
def test_a_source_that_stands_still_or_turns_otherwise_is_contradicted(
    bench: Bench, true: float, said: float
) -> None:
    bench.turn(0, 4000, true=true, said=said)
    bench.run(4000)
    at, fault = bench.said["fault"][0]
    assert at < 2500
    assert (fault.kind, fault.axis) == ("Implausible", "heading")
    assert math.copysign(1.0, fault.value) == math.copysign(1.0, true - said)
    assert bench.values("agrees")[0] is False


@pytest.mark.parametrize("leap", [3.0, 3.139, math.pi, 3.144, 3.3, -3.144])
def test_one_heading_half_a_circle_aside_is_contradicted_for_as_long_as_it_is_there(
    bench: Bench, leap: float
) -> None:
    bench.turn(0, 1000, true=0.0, said=0.0)
    bench.put(1000, rate=0.0, value=math.remainder(leap, math.tau))
    bench.turn(1010, 3000, true=0.0, said=0.0)
    assert bench.said["agrees"] == [(1000, False), (1010, True)]


def test_the_fault_is_repeated_once_a_window_and_says_for_how_long(bench: Bench) -> None:
    bench.turn(0, 8000, true=1.0, said=0.0)
    bench.run(8000)
    durations = [fault.duration / SECOND for fault in bench.values("fault")]
    assert durations == pytest.approx([0.01, 2.01, 4.01, 6.01])
    assert {fault.consecutive for fault in bench.values("fault")} == {1}


def test_a_fault_that_is_repeated_as_both_come_nearer_says_what_it_takes_to_agree_again(
    bench: Bench,
) -> None:
    bench.turn(0, 1000, true=1.0, said=0.0)
    for at in range(1000, 4000, 10):
        bench.put(at, rate=0.0, value=1.0)
    bench.run(4000)
    first, second = (fault.reason for fault in bench.values("fault"))
    assert first.endswith("expected 0.5 at most between both")
    assert second.endswith("expected 0.25 at most to agree again")


def test_they_agree_again_once_both_say_the_same(bench: Bench) -> None:
    bench.turn(0, 1000, true=1.0, said=0.0)
    bench.turn(1000, 9000, true=0.0, said=0.0)
    bench.run(9000)
    assert bench.values("agrees") == [False, True]


def test_a_source_that_pauses_contradicts_nothing(bench: Bench) -> None:
    bench.put(0, rate=0.0, value=0.0)
    bench.put(10, rate=0.0, value=0.0)
    bench.put(5000, rate=0.0, value=3.0)
    bench.put(5010, rate=0.0, value=3.0)
    bench.put(5020, value=3.0)
    bench.run(6000)
    assert bench.said.get("fault", []) == []


def test_what_a_busy_network_kept_and_brings_at_once_contradicts_nothing() -> None:
    bench = Bench(replace(SETTINGS, pause=SECOND // 20))
    for number in range(300):  # 2 rad/s, felt every 10 ms; those of 0.4 s come within 40 ms
        at_ms = 10 * number if not 100 <= number < 140 else 1260 + number
        bench.put(at_ms, rate=2.0, value=math.remainder(0.02 * number, math.tau))
    bench.run(3000)
    assert bench.said.get("fault", []) == []


def test_a_lie_after_a_pause_is_contradicted(bench: Bench) -> None:
    bench.turn(0, 100, true=1.0, said=1.0)
    bench.turn(5000, 9000, true=1.0, said=0.0)
    bench.run(9000)
    assert 5500 < bench.said["fault"][0][0] < 5800


@pytest.mark.parametrize(("true", "agreed"), [(100.0, []), (99.0, [False])])
def test_a_quantity_without_a_circle_may_grow_without_end_and_no_share_of_it_is_believed(
    true: float, agreed: list[bool]
) -> None:
    bench = Bench(CrossCheckSettings(quantity="way", windows=(Window(SECOND, 0.1),)))
    for at in range(0, 1000, 10):
        bench.put(at, rate=100.0, value=true * at / 1000)
    bench.run(1000)
    assert bench.values("agrees") == agreed


BRIEFLY = CrossCheckSettings(
    quantity="heading",
    windows=(Window(SECOND // 2, 0.15), Window(2 * SECOND, 0.5)),
    share=0.1,
    circle=math.tau,
)


def test_a_short_window_finds_sooner_what_is_far_off_and_a_long_one_what_is_a_little_off() -> None:
    first = {}
    for said in (0.5, 0.32):
        bench = Bench(BRIEFLY)
        bench.turn(0, 6000, true=0.0, said=said)
        bench.run(6000)
        assert True not in bench.values("agrees")  # what a long one finds no short one forgives
        first[said] = bench.said["agrees"][0][0]
    assert first[0.5] < 600
    assert first[0.32] > 2000


def test_all_windows_begin_again_once_both_have_agreed_in_the_shortest() -> None:
    bench = Bench(BRIEFLY)
    bench.turn(0, 1000, true=2.0, said=-2.0)
    bench.turn(1000, 5000, true=0.0, said=0.0)
    bench.run(5000)
    again = [at for at, agrees in bench.said["agrees"] if agrees]
    assert len(again) == 1
    assert again[0] < 2500


WIDELY = CrossCheckSettings(
    quantity="heading",
    windows=(Window(5 * SECOND, 0.2),),
    share=0.8,
    standstill=Standstill(0.05, 0.3),
    circle=math.tau,
)
"""Of sources whose scales may differ much."""


def first_fault_of_a_value_that_stops(settings: CrossCheckSettings) -> float:
    """When a value is contradicted that stands still after a second of a turn at 0.5 rad/s, ms."""
    bench = Bench(settings)
    bench.turn(0, 1000, true=0.5, said=0.5)
    for at in range(1000, 8000, 10):
        bench.put(at, rate=0.5, value=0.5 + 0.02 * (at % 20 == 0))  # a little noise
    bench.run(8000)
    return float(bench.said["fault"][0][0])


def test_a_value_that_stops_amid_a_change_is_found_at_once_whatever_share_is_believed() -> None:
    assert 1550 < first_fault_of_a_value_that_stops(WIDELY) < 1650
    assert first_fault_of_a_value_that_stops(replace(WIDELY, standstill=None)) > 3000


def test_a_pause_amid_a_standstill_begins_it_anew() -> None:
    bench = Bench(WIDELY)
    for begin in (0, 7000):
        for at in range(begin, begin + 500, 10):
            bench.put(at, rate=0.5, value=0.5)
    bench.run(7500)
    assert bench.values("agrees") == []


@pytest.mark.parametrize("share", [0.2, 0.5, 1.0, 1.7])
def test_a_value_that_moves_by_another_scale_does_not_stand_still(share: float) -> None:
    bench = Bench(WIDELY)
    bench.turn(0, 5000, true=0.5 * share, said=0.5)
    bench.run(5000)
    assert bench.said.get("fault", []) == []


def test_the_fault_of_a_value_that_stands_still_says_by_how_much_it_lags_behind() -> None:
    bench = Bench(WIDELY)
    bench.turn(0, 1000, true=0.0, said=0.5)
    bench.run(1000)
    assert bench.faults[0].value == pytest.approx(-0.3, abs=0.01)
    assert bench.faults[0].reason.endswith("expected 0.3 at most between both")


def test_a_value_that_stood_still_is_believed_again_once_it_moves() -> None:
    bench = Bench(WIDELY)
    bench.turn(0, 800, true=0.0, said=0.5)
    bench.turn(800, 1500, true=0.5, said=0.5)
    bench.run(1500)
    again = [at for at, agrees in bench.said["agrees"] if agrees]
    assert len(again) == 1
    assert 800 < again[0] < 1500


@pytest.mark.parametrize(
    ("most", "said"),
    [(0.3, "0.3"), (16.1809, "16.1"), (15.0, "15"), (0.11419, "0.114"), (360, "360")],
)
def test_a_limit_is_never_rounded_to_more(most: float, said: str) -> None:
    assert _at_most(most) == said
