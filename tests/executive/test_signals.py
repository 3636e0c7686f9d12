"""Signals stop a run in real time, wherever it is."""

import os
import signal

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.statistics.statistics import RunState
from firmware_runtime.system.signals import STOPS, stop_on_signals
from tests.support.executives import Run
from tests.support.periodic_models import Robot


@pytest.mark.parametrize("number", STOPS, ids=lambda number: number.name)
def test_a_signal_becomes_a_request_with_its_name(number: signal.Signals) -> None:
    requests: list[str] = []
    with stop_on_signals(requests.append):
        os.kill(os.getpid(), number)
    assert requests == [number.name]


def test_what_was_installed_before_is_installed_again() -> None:
    before = [signal.getsignal(number) for number in STOPS]
    with stop_on_signals(lambda _name: None):
        assert [signal.getsignal(number) for number in STOPS] != before
    assert [signal.getsignal(number) for number in STOPS] == before


def test_a_signal_ends_a_wait_that_would_have_lasted() -> None:
    robot = Robot(imu=1000 * SECOND)
    run = Run(robot, MonotonicClock())
    robot.thrust.work = lambda _value: os.kill(os.getpid(), signal.SIGTERM)
    with stop_on_signals(run.executive.request_stop):
        outcome = run.until(1000 * SECOND)
    assert (outcome.state, outcome.reason) == (RunState.STOPPED, "SIGTERM")
    assert run.made_safe == 2
    assert run.json()["conditions"]["run"]["state"] == "stopped"
