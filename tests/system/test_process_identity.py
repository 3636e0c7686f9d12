"""When a process started, by the clock that everything else goes by."""

import subprocess
import sys
from time import monotonic_ns

from tests.support.waiting import PATIENCE_S

CHILD = """
from time import monotonic_ns
now = monotonic_ns()
from firmware_runtime.system.process_identity import started_at
print(now, started_at())
"""
LONGEST_TICK = 10_000_000


def test_a_process_started_before_anything_it_does_and_after_it_was_called_for() -> None:
    called_for = monotonic_ns()
    command = [sys.executable, "-c", CHILD]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=PATIENCE_S)
    first, started = map(int, done.stdout.split())
    assert called_for - LONGEST_TICK <= started <= first
