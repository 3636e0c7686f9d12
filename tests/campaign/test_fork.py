"""A child of this process: its answer, and how it dies."""

import faulthandler
import os
import signal
import sys
from time import process_time

import pytest

from firmware_runtime.lab.campaign import fork
from firmware_runtime.lab.campaign.fork import HANG, STILL, in_child
from firmware_runtime.lab.sweeps.row import Row


def test_a_child_has_what_was_computed_before_and_keeps_what_it_changes_to_itself() -> None:
    kept = [1]

    def work() -> Row:
        kept.append(2)
        return {"sum": sum(kept)}

    assert in_child(work) == {"sum": 3}
    assert kept == [1]


def test_a_child_that_dies_is_a_sentence() -> None:
    def killed() -> Row:
        faulthandler.disable()  # pytest's would print the stack of each thread
        os.kill(os.getpid(), signal.SIGSEGV)
        return {}

    def broken() -> Row:
        raise ValueError

    assert in_child(killed) == "its process ended by SIGSEGV"
    assert in_child(broken) == "it ended with 1"


@pytest.mark.slow
def test_a_child_that_hangs_is_ended_by_the_time_it_has_used(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def hang() -> Row:
        while True:
            pass

    monkeypatch.setattr(fork, "CPU_S", 1)
    assert in_child(hang) == HANG


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="no other system shows that a process sleeps")
def test_a_child_that_waits_for_what_does_not_come_is_ended(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def wait() -> Row:
        os.read(os.pipe()[0], 1)
        return {}

    monkeypatch.setattr(fork, "STILL_S", 0.1)
    assert in_child(wait) == STILL


@pytest.mark.slow
def test_a_child_may_wait_for_one_of_its_own_that_works(monkeypatch: pytest.MonkeyPatch) -> None:
    def work() -> Row:
        while process_time() < 3.0:
            pass
        return {"is": "done"}

    monkeypatch.setattr(fork, "STILL_S", 1.5)
    assert in_child(lambda: {"its own": in_child(work)}) == {"its own": {"is": "done"}}


def test_a_child_answers_whatever_it_has_left_behind() -> None:
    reading, writing = os.pipe()

    def work() -> Row:
        if os.fork() == 0:
            os.close(writing)
            os.read(reading, 1)  # until the test is over
            os._exit(0)
        return {"is": "done"}

    assert in_child(work) == {"is": "done"}
    os.close(writing)
    os.close(reading)


def test_a_child_that_is_killed_has_not_used_its_time() -> None:
    def killed() -> Row:
        os.kill(os.getpid(), signal.SIGKILL)
        return {}

    assert in_child(killed) == "its process ended by SIGKILL"
