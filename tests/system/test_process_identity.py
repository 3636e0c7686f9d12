"""When a process started, by the clock that everything else goes by."""

import os
import subprocess
import sys
from time import monotonic_ns

import pytest

from firmware_runtime.system import this_process
from tests.support.waiting import PATIENCE_S

CHILD = """
from time import monotonic_ns
now = monotonic_ns()
from firmware_runtime.system.this_process import started_at
print(now, started_at())
"""
LONGEST_TICK = 10_000_000


def test_a_process_started_before_anything_it_does_and_after_it_was_called_for() -> None:
    called_for = monotonic_ns()
    command = [sys.executable, "-c", CHILD]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=PATIENCE_S)
    first, started = map(int, done.stdout.split())
    assert called_for - LONGEST_TICK <= started <= first


def test_a_pause_between_the_readings_of_two_clocks_moves_no_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    boot, awake, pause = 10**15, 4 * 10**14, 50_000_000
    readings = iter([awake + pause])
    monkeypatch.setattr(this_process, "clock_gettime_ns", lambda _clock: boot)
    monkeypatch.setattr(this_process, "monotonic_ns", lambda: next(readings, awake))
    monkeypatch.setattr(this_process, "_started_ticks", lambda _pid: 1000)
    monkeypatch.setattr(os, "sysconf", lambda _name: 100)
    assert this_process.started_at() == 10 * 1_000_000_000 - (boot - awake)
