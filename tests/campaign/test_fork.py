"""A child of this process: its answer, and how it dies."""

import faulthandler
import os
import signal

import pytest

from firmware_runtime.lab.campaign import fork
from firmware_runtime.lab.campaign.fork import HANG, in_child
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
