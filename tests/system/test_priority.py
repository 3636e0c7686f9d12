"""What switches off comes before ordinary processes."""

import os
import subprocess
import sys

import pytest

from firmware_runtime.system.this_process import come_first

VERB = (
    "import os, sys; from firmware_runtime.cli.main import main; "
    "main(); print(os.sched_getscheduler(0), os.sched_getparam(0).sched_priority)"
)


@pytest.mark.slow
@pytest.mark.skipif(os.geteuid() != 0, reason="only root may be scheduled first without a limit")
@pytest.mark.parametrize(
    ("verb", "scheduled"), [("safe-state", [os.SCHED_FIFO, 61]), ("check", [os.SCHED_OTHER, 0])]
)
def test_safe_state_comes_before_ordinary_processes_and_no_other_verb_does(
    verb: str, scheduled: list[int]
) -> None:
    command = [sys.executable, "-c", VERB, verb, "nothing"]
    ended = subprocess.run(command, capture_output=True, text=True, check=True)
    assert [int(word) for word in ended.stdout.split()] == scheduled


def test_the_highest_priority_that_is_allowed_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[int] = []

    def take(_process: int, _policy: int, parameter: os.sched_param) -> None:
        if parameter.sched_priority > 60:
            raise PermissionError(1, "Operation not permitted")
        taken.append(parameter.sched_priority)

    monkeypatch.setattr(os, "sched_setscheduler", take)
    come_first()
    assert taken == [60]
