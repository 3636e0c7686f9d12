import gc
import os
from select import select
from threading import Thread

import pytest

from firmware_runtime.executive.inbox import CAPACITY, Inbox
from sim_doubles.clock import ManualClock
from tests.support.periodic_models import Robot


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
