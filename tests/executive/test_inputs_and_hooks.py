"""Inputs that arrive, hooks between steps, and what a policy and a meter say."""

import gc
import math
import os
from collections.abc import Sequence
from select import select
from threading import Thread
from types import SimpleNamespace
from typing import Any

import pytest

from firmware_runtime.devs.ports import InPort
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.inbox import CAPACITY, Arrivals, Bag, EventSource, Inbox
from firmware_runtime.executive.ledger import BusMeter
from firmware_runtime.executive.policy import ActivationPolicy
from firmware_runtime.statistics.histogram import empty_cells
from firmware_runtime.statistics.layout import DEVICES, Layout
from sim_doubles.clock import ManualClock
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot
from tests.support.stalling_clock import StallingClock


class Burst:
    """A source that has `size` values whenever it is asked."""

    def __init__(self, port: InPort[int], size: int) -> None:
        self.port = port
        self.size = size

    def fileno(self) -> int:
        return -1  # there is no wait for it here

    def receive(self) -> Sequence[tuple[InPort[int], object]]:
        return [(self.port, number) for number in range(self.size)]


class Pair(EventSource):
    """A source of two events, each of one value, whenever it is asked."""

    def __init__(self, port: InPort[int]) -> None:
        self.port = port

    def fileno(self) -> int:
        return -1  # as above

    def events(self) -> Sequence[Bag]:
        return [[(self.port, 1)], [(self.port, 2)]]


def test_nothing_has_arrived_at_first() -> None:
    inbox = Inbox(ManualClock())
    arrivals = Arrivals(inbox, [])
    assert arrivals.next_at(5) == NEVER
    assert list(arrivals.take(NEVER)) == []
    assert arrivals.sources(waits=True) == [inbox]


def test_an_inbox_is_asked_only_when_it_was_woken_where_nothing_waits() -> None:
    inbox, robot = Inbox(ManualClock()), Robot()
    arrivals = Arrivals(inbox, [])
    assert arrivals.sources(waits=False) == []
    inbox.post(robot.command, 1)
    assert arrivals.sources(waits=False) == [inbox]
    arrivals.receive([inbox], now=0)
    assert arrivals.sources(waits=False) == []
    inbox.wake()
    assert arrivals.sources(waits=False) == [inbox]


def test_a_source_beside_the_inbox_is_always_asked() -> None:
    burst = Burst(Robot().command, CAPACITY)
    arrivals = Arrivals(Inbox(ManualClock()), [burst])
    assert burst in arrivals.sources(waits=False)
    arrivals.receive([burst], now=1)
    assert arrivals.sources(waits=False) == []


def test_what_a_source_gives_at_once_shares_the_instant_of_reading() -> None:
    robot = Robot()
    arrivals = Arrivals(Inbox(ManualClock()), [])
    arrivals.receive([Burst(robot.command, 2)], now=30)
    arrivals.receive([Burst(robot.replan, 1)], now=40)
    assert arrivals.next_at(0) == 30
    assert list(arrivals.take(39)) == [(robot.command, 0), (robot.command, 1)]
    assert arrivals.next_at(0) == 40


def test_a_value_is_never_handled_before_what_has_already_happened() -> None:
    arrivals = Arrivals(Inbox(ManualClock()), [])
    arrivals.receive([Burst(Robot().command, 1)], now=30)
    assert arrivals.next_at(35) == 35


def test_a_source_that_is_added_is_waited_for_and_its_events_have_an_instant_each() -> None:
    robot = Robot()
    arrivals, pair = Arrivals(inbox := Inbox(ManualClock()), []), Pair(robot.command)
    arrivals.add_source(pair)
    assert arrivals.sources(waits=True) == [inbox, pair]
    arrivals.receive([pair, pair], now=0)
    assert [at for at, _, _ in arrivals.waiting] == [0, 1, 2, 3]


def test_what_is_planned_comes_among_what_arrives_and_first_of_one_instant() -> None:
    robot = Robot()
    arrivals = Arrivals(Inbox(ManualClock()), [])
    arrivals.plan(20, robot.replan, 3)
    arrivals.plan(10, robot.replan, 1)
    arrivals.plan(10, robot.replan, 2)
    assert arrivals.next_at(0) == 10
    arrivals.receive([Burst(robot.command, 1)], now=5)
    arrivals.receive([Burst(robot.command, 1)], now=10)
    came = []
    while (at := arrivals.next_at(0)) < NEVER:
        came.append((at, [value for _, value in arrivals.take(at)]))
    assert came == [(5, [0]), (10, [1, 2, 0]), (20, [3])]


def test_sources_are_not_read_while_too_much_waits() -> None:
    burst = Burst(Robot().command, CAPACITY)
    arrivals = Arrivals(Inbox(ManualClock()), [burst])
    arrivals.receive([burst], now=1)
    assert arrivals.sources(waits=True) == []
    assert len(list(arrivals.take(1))) == CAPACITY
    assert burst in arrivals.sources(waits=True)


@pytest.fixture
def now() -> ManualClock:
    return ManualClock()


@pytest.fixture
def inbox(now: ManualClock) -> Inbox:
    return Inbox(now)


def is_readable(inbox: Inbox) -> bool:
    return bool(select([inbox], [], [], 0)[0])


def test_values_come_out_in_order_each_with_its_instant(inbox: Inbox, now: ManualClock) -> None:
    robot = Robot()
    inbox.post(robot.command, 1)
    now.advance(5)
    inbox.post(robot.replan, 2)
    assert inbox.take() == [(0, robot.command, 1), (5, robot.replan, 2)]
    assert inbox.take() == []


def test_it_is_readable_from_a_post_until_it_is_taken(inbox: Inbox) -> None:
    robot = Robot()
    assert not is_readable(inbox)
    inbox.post(robot.command, 1)
    inbox.post(robot.command, 2)
    assert is_readable(inbox)
    inbox.take()
    assert not is_readable(inbox)


def test_waking_brings_no_value(inbox: Inbox) -> None:
    inbox.wake()
    assert is_readable(inbox)
    assert inbox.take() == []
    assert not is_readable(inbox)


def test_what_does_not_fit_is_dropped_and_counted(inbox: Inbox) -> None:
    robot = Robot()
    for _ in range(CAPACITY):
        assert inbox.post(robot.command, 0)
    assert not inbox.post(robot.command, 1)
    assert inbox.dropped == 1
    assert len(inbox.take()) == CAPACITY
    assert inbox.post(robot.command, 2)


def test_another_thread_may_post(inbox: Inbox) -> None:
    robot = Robot()
    thread = Thread(target=lambda: inbox.post(robot.command, 3))
    thread.start()
    thread.join()
    assert [value for _, _, value in inbox.take()] == [3]


def test_its_descriptor_is_closed_with_it(now: ManualClock) -> None:
    inbox = Inbox(now)
    descriptor = inbox.fileno()
    del inbox
    gc.collect()
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(descriptor)


class Diary:
    """A hook that keeps when it was called, and what time it was given."""

    def __init__(self, run: Run) -> None:
        self.calls: list[tuple[int, int]] = []
        run.executive.hooks.append(self)

    def between_steps(self, now: int, left: int) -> None:
        self.calls.append((now, left))


def test_they_are_called_before_each_wait_with_the_time_to_the_next_event() -> None:
    run = Run(Robot(), VirtualClock())
    diary = Diary(run)
    run.until(3 * PERIOD)
    assert diary.calls[:4] == [(0, 0), (0, PERIOD), (PERIOD, PERIOD), (2 * PERIOD, PERIOD)]


def test_what_a_step_took_is_not_left() -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock)
    diary = Diary(run)
    robot.imu.work = lambda _number: clock.spend(4 * MILLISECOND)
    run.until(PERIOD)
    assert diary.calls[1] == (4 * MILLISECOND, PERIOD - 4 * MILLISECOND)


def test_a_late_loop_has_nothing_left_and_calls_them_all_the_same() -> None:
    robot, clock = Robot(), StallingClock()
    run = Run(robot, clock, Configuration(policies={"imu": ActivationPolicy("catch-up")}))
    first, second = Diary(run), Diary(run)
    robot.imu.work = lambda number: clock.spend(PERIOD + 1) if number == 1 else None
    run.until(3 * PERIOD)
    assert (2 * PERIOD + 1, -1) in first.calls
    assert first.calls == second.calls


def test_the_end_of_the_run_is_no_less_near_than_an_event() -> None:
    run = Run(Robot(), VirtualClock())
    diary = Diary(run)
    run.until(PERIOD + 1)
    assert diary.calls[-1] == (PERIOD, 1)


class Prompt(Diary):
    """A hook that is to be called at an instant between two steps, once."""

    def between_steps(self, now: int, left: int) -> None:
        super().between_steps(now, left)
        if now < PERIOD // 2:
            self.run.executive.poll_by(PERIOD // 2)

    def __init__(self, run: Run) -> None:
        super().__init__(run)
        self.run = run


def test_a_hook_is_called_at_the_instant_it_asked_for_and_no_step_is_made_there() -> None:
    run = Run(Robot(), VirtualClock())
    prompt, other = Prompt(run), Diary(run)
    run.until(PERIOD)
    asked_for = (PERIOD // 2, PERIOD - PERIOD // 2)
    assert prompt.calls == other.calls == [(0, 0), (0, PERIOD), asked_for, (PERIOD, 0)]


class Offered:
    """What time garbage may be collected in, where the run would have it so."""

    def __init__(self) -> None:
        self.lefts: list[int] = []

    def offer(self, left: int) -> None:
        self.lefts.append(left)


def test_garbage_is_collected_before_the_instant_that_a_hook_asked_for() -> None:
    run, offered = Run(Robot(), VirtualClock()), Offered()
    Prompt(run)
    run.executive._loop.collector = offered  # type: ignore[assignment]
    run.until(PERIOD)
    assert offered.lefts == [0, PERIOD // 2, PERIOD // 2, 0]


def test_the_tolerance_is_a_tenth_of_the_period_unless_stated() -> None:
    assert ActivationPolicy().tolerance(10 * MILLISECOND) == MILLISECOND
    assert ActivationPolicy(tolerance_us=1.5).tolerance(10 * MILLISECOND) == 1500


def test_only_policy_stop_stops() -> None:
    assert ActivationPolicy("stop", stop_after_us=2.5).stop_after() == 2500
    assert ActivationPolicy("catch-up").stop_after() == NEVER


@pytest.mark.parametrize("policy", [("stop", None), ("skip", 5), ("catch-up", 5)])
def test_a_limit_belongs_to_policy_stop_and_to_no_other(policy: tuple[str, float | None]) -> None:
    kind, limit = policy
    with pytest.raises(ValueError, match="stop_after_us belongs to policy stop"):
        ActivationPolicy(kind, stop_after_us=limit)  # type: ignore[arg-type]


@pytest.mark.parametrize("number", [0, -1, math.nan, math.inf])
def test_numbers_that_are_no_spans_are_refused(number: float) -> None:
    with pytest.raises(ValueError, match=r"tolerance_us = .*expected a positive number"):
        ActivationPolicy(tolerance_us=number)
    with pytest.raises(ValueError, match=r"stop_after_us = .*expected a positive number"):
        ActivationPolicy("stop", stop_after_us=number)


LAYOUT = Layout(buses=("i2c1",))


def bus(*busy_ns: int) -> Any:  # noqa: ANN401 -- stands in for any bus
    devices = {0x40 + index: SimpleNamespace(busy_ns=busy) for index, busy in enumerate(busy_ns)}
    return SimpleNamespace(
        name="i2c1",
        transactions=3,
        bytes=70,
        errors=2,
        retries=1,
        busy_ns=sum(busy_ns),
        by_address=devices,
    )


def test_counters_are_copied_as_they_are() -> None:
    cells = empty_cells(LAYOUT.cells)
    BusMeter(bus(500, 900), cells, LAYOUT, 0).read()
    assert list(cells[LAYOUT.bus(0) : LAYOUT.bus(0) + 5]) == [3, 70, 2, 1, 1400]


def test_a_device_is_charged_what_it_took_since_the_last_reading() -> None:
    i2c = bus(500, 900)
    meter = BusMeter(i2c, empty_cells(LAYOUT.cells), LAYOUT, 0)
    i2c.by_address[0x41].busy_ns += 70
    meter.read()
    assert (meter.addresses(), meter.spent) == ([0x40, 0x41] + [0] * 6, [0, 70] + [0] * 6)


def test_a_ninth_device_has_no_place_of_its_own() -> None:
    meter = BusMeter(bus(*range(1, 12)), empty_cells(LAYOUT.cells), LAYOUT, 0)
    meter.read()
    assert len(meter.addresses()) == len(meter.spent) == DEVICES
