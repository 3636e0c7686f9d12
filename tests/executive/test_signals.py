"""Signals stop a run in real time, wherever it is."""

import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from select import select
from types import FrameType

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.system.signals import (
    ENDS,
    STOPS,
    signal_name,
    signal_number,
    stop_on_signals,
)
from tests.support.executives import Run
from tests.support.periodic_models import Robot
from tests.support.terminal import terminal_of
from tests.support.waiting import PATIENCE_S

HANDLED = (*STOPS, *ENDS)
BY_A_FAULT = {
    *(signal.SIGABRT, signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL),
    *(signal.SIGTRAP, signal.SIGSYS),
}
HALTS = {signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU}
IGNORED = {signal.SIGCHLD, signal.SIGCONT, signal.SIGURG, signal.SIGWINCH}


@pytest.mark.parametrize("number", HANDLED, ids=signal_name)
def test_a_signal_becomes_a_request_with_its_name(number: int) -> None:
    requests: list[str] = []
    before = signal.signal(number, signal.SIG_DFL)
    try:
        with stop_on_signals(requests.append, is_driving=True):
            os.kill(os.getpid(), number)
    finally:
        signal.signal(number, before)
    assert requests == [signal_name(number)]
    assert signal_number(requests[0]) == number


def test_every_signal_that_another_program_can_end_a_run_by_is_handled() -> None:
    """SIGKILL and SIGSTOP cannot be; Python itself ignores SIGPIPE and SIGXFSZ."""
    others = {signal.SIGKILL, signal.SIGSTOP, signal.SIGPIPE, signal.SIGXFSZ}
    assert set(signal.valid_signals()) - set(HANDLED) == BY_A_FAULT | HALTS | IGNORED | others


def test_what_was_installed_before_is_installed_again() -> None:
    before = [signal.getsignal(number) for number in signal.valid_signals()]
    with stop_on_signals(lambda _name: None, is_driving=True):
        assert [signal.getsignal(number) for number in signal.valid_signals()] != before
    assert [signal.getsignal(number) for number in signal.valid_signals()] == before


def test_a_signal_that_the_program_handles_stays_its_own() -> None:
    requests: list[str] = []
    taken: list[int] = []

    def take(number: int, _frame: FrameType | None) -> None:
        taken.append(number)

    before = signal.signal(signal.SIGUSR1, take)
    try:
        with stop_on_signals(requests.append, is_driving=True):
            os.kill(os.getpid(), signal.SIGUSR1)
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert (requests, taken) == ([], [signal.SIGUSR1])


def test_a_terminal_halts_nothing_that_drives() -> None:
    requests: list[str] = []
    with stop_on_signals(requests.append, is_driving=True):
        for number in HALTS:
            os.kill(os.getpid(), number)
    assert requests == ["SIGTSTP"]


def test_what_drives_nothing_may_be_halted_or_ended() -> None:
    others = {*HALTS, *ENDS}
    before = {number: signal.getsignal(number) for number in others}
    with stop_on_signals(lambda _name: None):
        assert {number: signal.getsignal(number) for number in others} == before


@pytest.mark.real_time
@pytest.mark.parametrize(("key", "name"), [(b"\x1a", "SIGTSTP"), (b"\x1c", "SIGQUIT")])
def test_a_key_of_the_terminal_ends_a_run_in_order(tmp_path: Path, key: bytes, name: str) -> None:
    words = ("run", "tachobot", "--doubles", "--statistics", str(tmp_path / "run.statistics"))
    shown = b""
    with terminal_of(sys.executable, "-m", "firmware_runtime.cli", *words) as (run, ours):
        while b" of 10 s" not in shown:  # the line of its progress
            shown += read(ours)
        os.write(ours, key)
        with suppress(OSError):  # what reading says once the other end is closed
            while piece := read(ours):
                shown += piece
        assert run.wait(PATIENCE_S) == 143
    assert name.encode() in shown


def read(terminal: int) -> bytes:
    assert select([terminal], (), (), PATIENCE_S)[0], "nothing is printed"
    return os.read(terminal, 4096)


def test_a_signal_ends_a_wait_that_would_have_lasted() -> None:
    robot = Robot(imu=1000 * SECOND)
    run = Run(robot, MonotonicClock())
    robot.thrust.work = lambda _value: os.kill(os.getpid(), signal.SIGTERM)
    with stop_on_signals(run.executive.request_stop):
        outcome = run.until(1000 * SECOND)
    assert (outcome.state, outcome.reason) == (RunState.STOPPED, "SIGTERM")
    assert run.made_safe == 2
    assert run.json()["conditions"]["run"]["state"] == "stopped"
