"""A real run that is stopped for a moment, seen by `perfetto` in another process."""

import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.trace_rules import assert_sound, slices
from tests.support.waiting import PATIENCE_S

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")
LIMIT_US = 100_000

pytestmark = [pytest.mark.slow, pytest.mark.real_time]


def test_a_stall_takes_a_trace_that_shows_it(tmp_path: Path) -> None:
    output = tmp_path / "trace.json"
    run = started("run", "tachobot", "--doubles", "--for", "600")
    try:
        wait_for_steps(run)
        watch = started("export", "tachobot", "-o", str(output), "--when-late", str(LIMIT_US))
        stall_until_it_ends(run, watch)
        said, complaint = watch.communicate(timeout=PATIENCE_S)
    finally:
        run.kill()
        run.communicate(timeout=PATIENCE_S)
    assert (watch.returncode, complaint) == (0, "")
    assert re.search("taken because of (imu|thrust_pairs) at ", said)
    trace = json.loads(output.read_text())
    assert_sound(trace)
    (mark,) = [each for each in trace["traceEvents"] if each.get("s") == "g"]
    late = [(begin, end) for _, _, begin, end in slices(trace, "waking") if end - begin > LIMIT_US]
    assert any(begin < mark["ts"] <= end + 1000 for begin, end in late)
    assert {depth for depth, *_ in slices(trace, "loop")} == {0, 1}


def started(*words: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def wait_for_steps(run: "subprocess.Popen[str]") -> None:
    """Return once the run is seen to count; each look starts a process, so nothing spins."""
    for _look in range(200):
        if run.poll() is not None:
            break
        seen = looked()
        if seen.returncode == 0 and json.loads(seen.stdout)["run"] > 0:
            return
    pytest.fail(f"the run did not get going: {run.poll()}")


def stall_until_it_ends(run: "subprocess.Popen[str]", watch: "subprocess.Popen[str]") -> None:
    """Stop the run for as long as another process takes, until the watch has seen it."""
    for _stall in range(200):
        if watch.poll() is not None:
            return
        run.send_signal(signal.SIGSTOP)
        looked()
        run.send_signal(signal.SIGCONT)
        looked()


def looked() -> "subprocess.CompletedProcess[str]":
    words = [*COMMAND, "stats", "tachobot", "--json"]
    return subprocess.run(words, capture_output=True, text=True, check=False)
