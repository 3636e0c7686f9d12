"""Faults and lateness are counted, garbage is collected in slack, memory stays level."""

import gc
import tracemalloc
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import pytest

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.executive import garbage
from firmware_runtime.executive.clocks import HasDescriptor, MonotonicClock, VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.garbage import EVERY_NTH_IS_FULL, GarbageTime, SlackCollector
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.executive.process import ProcessSettings
from firmware_runtime.hal.wire_errors import Fault
from firmware_runtime.statistics.fault_table import KIND_CELLS, KINDS, OTHER_KINDS
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import SEQUENCE
from sim_doubles.clock import ManualClock
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot
from tests.support.stalling_clock import StallingClock

REPORTED_EVERY = 10 * MILLISECOND


class GraveFault(Fault):
    """A fault of another model's making."""


class Failing(Atomic):
    """Reports a fault every period, of the kind that its number is mapped to; some have none."""

    def __init__(self, name: str, *kinds: str | None, type_: type[Fault] = Fault) -> None:
        super().__init__(name)
        self.trouble = self.out_port("trouble", type_)
        self.values = self.out_port("values", float)
        self.kinds = list(kinds)
        self.type = type_

    def initialize(self) -> None:
        self.hold_in("failing", REPORTED_EVERY)

    def output(self) -> None:
        self.values.send(1.0)
        if self.kinds and self.kinds[0] is not None:
            self.trouble.send(self.type(self.kinds[0], f"sentence {len(self.kinds)}", 1))

    def internal(self) -> None:
        del self.kinds[:1]
        self.hold_in("failing", REPORTED_EVERY)


class Collecting(Atomic):
    """Takes faults in."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.faults = self.in_port("faults", Fault)
        self.taken: list[Fault] = []

    def external(self, elapsed: int) -> None:
        self.taken += self.faults
        self.continue_(elapsed)


def faults_of(*models: Atomic, periods: int = 50) -> dict[str, Any]:
    root = Coupled("robot")
    for model in models:
        root.add(model)
    run = Run(root, VirtualClock())
    run.until(periods * REPORTED_EVERY)
    faults: dict[str, Any] = run.json()["faults"]
    return faults


def test_a_port_that_nothing_is_coupled_to_counts() -> None:
    assert faults_of(Failing("imu", "NotReady", None, "NotReady", "NotReady", None)) == {
        "imu": {"NotReady": {"count": 3, "first_s": 0.01, "last_s": 0.04, "last": "sentence 2"}}
    }


def test_a_port_that_is_coupled_counts_once_however_many_take_it() -> None:
    root = Coupled("robot")
    failing = root.add(Failing("imu", "NotReady"))
    takers = [root.add(Collecting(name)) for name in ("first", "second")]
    for taker in takers:
        root.couple(failing.trouble, taker.faults)
    run = Run(root, VirtualClock())
    run.until(5 * REPORTED_EVERY)
    assert run.json()["faults"]["imu"]["NotReady"]["count"] == 1
    assert [len(taker.taken) for taker in takers] == [1, 1]


def test_a_port_of_a_narrower_type_counts_too() -> None:
    assert "imu" in faults_of(Failing("imu", "NotReady", type_=GraveFault))


def test_models_and_kinds_are_kept_apart_and_named_by_path() -> None:
    inner = Coupled("arm")
    inner.add(Failing("motor", "BusFault", "NotReady", "BusFault"))
    root = Coupled("robot")
    root.add(inner)
    root.add(Failing("imu", "NotReady"))
    root.add(Failing("calm"))
    run = Run(root, VirtualClock())
    run.until(10 * REPORTED_EVERY)
    counts = {
        path: {kind: each["count"] for kind, each in kinds.items()}
        for path, kinds in run.json()["faults"].items()
    }
    assert counts == {"arm.motor": {"BusFault": 2, "NotReady": 1}, "imu": {"NotReady": 1}}


def test_a_flood_of_kinds_is_bounded_and_none_goes_uncounted() -> None:
    kinds = [f"Kind{number % (KINDS + 5)}" for number in range(40)]
    found = faults_of(Failing("imu", *kinds))["imu"]
    assert sum(each["count"] for each in found.values()) == 40
    assert len(found) == KINDS + 1
    assert found[OTHER_KINDS]["count"] == sum(int(kind[4:]) >= KINDS for kind in kinds)


def test_a_fault_in_the_step_that_fails_is_counted_too() -> None:
    class Breaking(Failing):
        def internal(self) -> None:
            raise OSError("gone")

    assert faults_of(Breaking("imu", "BusFault"))["imu"]["BusFault"]["count"] == 1


def test_a_run_without_faults_has_none() -> None:
    assert faults_of(Failing("imu"), Collecting("sink")) == {}


class Watched:
    """Cells that note what is written into them outside of a section."""

    def __init__(self, cells: Cells) -> None:
        self.cells = cells
        self.outside: list[tuple[int, int]] = []

    def __getitem__(self, place: Any) -> Any:  # noqa: ANN401 -- as of a memoryview
        return self.cells[place]

    def __setitem__(self, place: int, value: int) -> None:
        sequence = self.cells[SEQUENCE]
        if value != sequence + 1 if place == SEQUENCE else sequence % 2 == 0:
            self.outside.append((place, value))
        self.cells[place] = value


def test_whatever_is_written_for_readers_is_within_a_section() -> None:
    failures = [["no acknowledge"], ["no acknowledge"]]
    robot, clock = Robot(), StallingClock({5: 50 * MILLISECOND, 120: SECOND})
    executive = Executive(robot, clock, lambda: failures.pop() if failures else [])
    executive.run_on(PERIOD)
    file = executive._ledger.file
    watched = file.cells = Watched(file.cells)  # type: ignore[assignment]
    executive.arm(armed=False, epoch=3)
    executive.give_up_priority()
    clock.at(155 * MILLISECOND, executive.inbox.wake)
    executive.run_on(3 * SECOND)
    executive.end()
    assert watched.outside == []


def test_kinds_alike_as_far_as_the_file_keeps_them_lose_no_fault() -> None:
    long = "Magnetometer".ljust(8 * KIND_CELLS, "s")
    kinds = [f"{long}{number % 12}" for number in range(40)]
    (counted,) = faults_of(Failing("compass", *kinds))["compass"].values()
    assert counted["count"] == 40


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


def test_a_step_that_ends_with_the_second_belongs_to_the_next_and_the_last_span_is_kept() -> None:
    run = Run(Robot(), VirtualClock())
    run.until(5 * SECOND // 2)
    spans = run.executive.statistics.timeline
    assert [(span.begin_ns, span.activations) for span in spans] == [
        (0, 100),
        (SECOND, 100),
        (2 * SECOND, 51),
    ]
    assert sum(span.activations for span in spans) == run.json()["run"]


def test_of_several_late_models_the_latest_counts() -> None:
    """Both are due at once and wake 1 ms late; the first takes 3 ms before the second begins."""
    robot, clock = Robot(imu=PERIOD, compass=PERIOD), StallingClock({2: MILLISECOND})
    run = Run(robot, clock)

    def receive(_at: int, number: int) -> None:
        clock.spend(3 * MILLISECOND if number == 2 else 0)

    run.executive.simulator.listen(robot.imu.sample, receive)
    run.until(3 * PERIOD)
    worst = run.json()["worst"][0]
    assert (worst["model"], worst["t_ns"], worst["lateness_us"]) == ("compass", 2 * PERIOD, 4000)
    (span,) = run.executive.statistics.timeline
    assert span.lateness_max_ns == 4 * MILLISECOND


def test_an_episode_keeps_its_latest_activation_not_the_last_or_the_least() -> None:
    """One stall of 35 ms, caught up with: late by 35, 25, 15 and 5 ms, then on time."""
    robot, clock = Robot(), StallingClock({2: 35 * MILLISECOND})
    policies = {"imu": ActivationPolicy("catch-up")}
    run = Run(robot, clock, Configuration(policies=policies))
    run.until(20 * PERIOD)
    (account,) = (each for each in run.executive.accounts if each.path == "imu")
    assert (account.overruns, account.episodes, account.in_episode) == (4, 1, False)
    assert account.latest_in_episode == 35 * MILLISECOND


WARM_UP, TICKS = 1_000, 12_000
NOT_OURS = [
    tracemalloc.Filter(inclusive=False, filename_pattern=name)
    for name in (tracemalloc.__file__, __file__)
]
S = TypeVar("S", bound=HasDescriptor)


class Ticker(Atomic):
    def initialize(self) -> None:
        self.hold_in("waiting", 10 * MILLISECOND)

    def internal(self) -> None:
        self.hold_in("waiting", 10 * MILLISECOND)


class SnapshotClock(MonotonicClock):
    """Real time of which each wait is over at once; takes a snapshot before two of them."""

    def __init__(self) -> None:
        super().__init__()
        self.snapshots: list[tracemalloc.Snapshot] = []
        self.when_done: Callable[[], None] = lambda: None
        self._waits = 0

    def wait(self, until: int, _sources: Sequence[S]) -> list[S]:
        if self._waits in (WARM_UP, WARM_UP + TICKS):
            gc.collect()
            self.snapshots.append(tracemalloc.take_snapshot().filter_traces(NOT_OURS))
            if len(self.snapshots) == 2:
                self.when_done()
        self._waits += 1
        self.start(until)
        return []


@pytest.mark.slow
def test_ticks_leave_nothing_behind(tmp_path: Path) -> None:
    root = Coupled("root")
    for number in range(4):
        root.add(Ticker(f"ticker_{number}"))
    clock = SnapshotClock()
    configuration = Configuration(
        process=ProcessSettings(freeze_garbage=True), statistics_path=tmp_path / "tickers.stats"
    )
    executive = Executive(root, clock, list, configuration)
    clock.when_done = lambda: executive.request_stop("enough")
    tracemalloc.start()
    try:
        executive.run(NEVER)  # a busy machine skips periods: the ticks that ran count
    finally:
        tracemalloc.stop()
    before, after = clock.snapshots
    grown = after.compare_to(before, "lineno")
    # It keeps a reading of the kernel's counters of some 2 kB now and then.
    assert sum(each.size_diff for each in grown) < TICKS, grown[:8]
