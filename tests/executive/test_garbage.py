import gc

import pytest

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.executive import garbage
from firmware_runtime.executive.garbage import EVERY_NTH_IS_FULL, GarbageTime, SlackCollector
from sim_doubles.clock import ManualClock


class Collections:
    """Stands in for the collector: `objects` wait for it, and a collection takes `span`."""

    def __init__(self, clock: ManualClock) -> None:
        self.clock = clock
        self.objects = 10_000
        self.span = MILLISECOND
        self.generations: list[int] = []

    def get_count(self) -> tuple[int, int, int]:
        return self.objects, 0, 0

    def collect(self, generation: int) -> None:
        self.generations.append(generation)
        self.clock.advance(self.span)


@pytest.fixture
def clock() -> ManualClock:
    return ManualClock()


@pytest.fixture
def collections(clock: ManualClock, monkeypatch: pytest.MonkeyPatch) -> Collections:
    stand_in = Collections(clock)
    monkeypatch.setattr(garbage, "gc", stand_in)
    return stand_in


def test_slack_that_is_long_enough_is_used(clock: ManualClock, collections: Collections) -> None:
    SlackCollector(clock).offer(5 * MILLISECOND)
    assert collections.generations == [1]


def test_slack_must_be_twice_the_longest_collection_and_a_millisecond(
    clock: ManualClock, collections: Collections
) -> None:
    collector = SlackCollector(clock)
    collector.offer(SECOND)
    collector.offer(3 * MILLISECOND - 1)
    assert len(collections.generations) == 1
    collector.offer(3 * MILLISECOND)
    assert len(collections.generations) == 2


def test_a_few_objects_are_not_worth_it(clock: ManualClock, collections: Collections) -> None:
    collections.objects = 999
    SlackCollector(clock).offer(NEVER)
    assert collections.generations == []


def test_too_many_objects_are_collected_even_without_slack(
    clock: ManualClock, collections: Collections
) -> None:
    collections.objects = 200_000
    SlackCollector(clock).offer(-5)
    assert collections.generations == [1]


def test_one_collection_in_sixteen_is_full(clock: ManualClock, collections: Collections) -> None:
    collector = SlackCollector(clock)
    for _ in range(2 * EVERY_NTH_IS_FULL):
        collector.offer(SECOND)
    assert collections.generations == ([1] * 15 + [2]) * 2


@pytest.mark.slow
def test_the_time_of_collections_adds_up_until_it_is_taken(clock: ManualClock) -> None:
    time = GarbageTime(clock)

    class Slow:
        def __del__(self) -> None:
            clock.advance(70)

    def make_garbage() -> None:
        cycle = Slow()
        cycle.itself = cycle  # type: ignore[attr-defined]

    with time.measured():
        make_garbage()
        gc.collect()
    assert time.spent == 70
    time.spent = 0
    make_garbage()
    gc.collect()
    assert time.spent == 0
