"""Stalls of the machine, in real time: what they cost must be in the accounts, by policy.

Other programs stall the run too, so at least the injected stall must be there; the sums are exact.
"""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from time import monotonic_ns
from typing import Any

import pytest

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND
from firmware_runtime.telemetry.statistics_reader import read_statistics

PERIOD = 2 * MILLISECOND
UNTIL = 1200 * MILLISECOND
STALL_S = 0.5
PATIENCE_NS = 30_000_000_000
DUE = UNTIL // PERIOD + 1

PROGRAM = """
import json, sys, threading
from pathlib import Path
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.loop import Executive
from firmware_runtime.executive.policy import ActivationPolicy
from tests.support.periodic_models import Robot
from tests.executive.test_real_stalls import PERIOD, UNTIL, busy

path, policy, stop_after_us, hog = sys.argv[1:]
robot = Robot(imu=PERIOD)
limit = float(stop_after_us) if policy == "stop" else None
policies = {"imu": ActivationPolicy(policy, stop_after_us=limit)}
configuration = Configuration(policies=policies, statistics_path=Path(path))
made_safe = []
executive = Executive(robot, MonotonicClock(), lambda: made_safe.append(1) or [], configuration)
sent = []
def note(at, value):
    sent.append(at)
    if hog == "busy" and len(sent) == 10:
        threading.Thread(target=busy, args=(300_000_000,), daemon=True).start()
executive.simulator.listen(robot.imu.sample, note)
outcome = executive.run(UNTIL)
print(json.dumps({
    "state": outcome.state.name, "sent": sent, "activations": robot.imu.activations,
    "made_safe": len(made_safe), "statistics": executive.statistics.as_json(),
}))
"""


def busy(span_ns: int) -> None:
    """Hold the interpreter as a thread does that computes."""
    until = monotonic_ns() + span_ns
    while monotonic_ns() < until:
        pass


class Stalled:
    """A run in a process of its own."""

    def __init__(self, path: Path, policy: str = "skip", hog: str = "") -> None:
        self.path = path
        command = [sys.executable, "-c", PROGRAM, str(path), policy, "100000", hog]
        root = Path(__file__).parents[2]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=root)

    def wait_for_activations(self, count: int) -> None:
        give_up_at = monotonic_ns() + PATIENCE_NS
        while monotonic_ns() < give_up_at:
            if self.path.exists() and read_statistics(self.path).as_json()["run"] >= count:
                return
        raise AssertionError(f"not {count} activations in {PATIENCE_NS // 10**9} s")

    def stall(self) -> int:
        """Stop the process for the time of a stall; return how long it stood at least, in ns."""
        self.process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, self.process.pid, os.WSTOPPED | os.WNOWAIT)
        stopped_at = monotonic_ns()
        with pytest.raises(subprocess.TimeoutExpired):
            self.process.wait(timeout=STALL_S)
        stood = monotonic_ns() - stopped_at
        self.process.send_signal(signal.SIGCONT)
        return stood

    def result(self) -> dict[str, Any]:
        said, _ = self.process.communicate(timeout=60)
        assert self.process.returncode == 0
        answer: dict[str, Any] = json.loads(said)
        counted = answer["statistics"]["models"]["imu"]
        assert counted["scheduled"] == counted["run"] + counted["skipped"] + counted["coalesced"]
        assert counted["run"] == answer["activations"]
        assert all(at % PERIOD == 0 for at in answer["sent"])
        assert len(set(answer["sent"])) == len(answer["sent"])
        return answer


@pytest.fixture
def started() -> Iterator[list[Stalled]]:
    runs: list[Stalled] = []
    yield runs
    for run in runs:
        run.process.kill()
        run.process.communicate()


@pytest.mark.slow
def test_a_stopped_process_skips_what_it_missed_and_keeps_its_phase(
    started: list[Stalled], tmp_path: Path
) -> None:
    run = Stalled(tmp_path / "robot.stats", "skip")
    started.append(run)
    run.wait_for_activations(20)
    stood = run.stall()
    answer = run.result()
    counted = answer["statistics"]["models"]["imu"]
    assert answer["state"] == "ENDED"
    assert counted["scheduled"] == DUE
    assert counted["skipped"] >= stood // PERIOD - 1
    assert counted["overruns"] >= 1
    assert counted["episodes"] <= counted["overruns"] + counted["skipped"]
    assert answer["statistics"]["lateness_us"]["max"] * MICROSECOND >= stood - PERIOD


@pytest.mark.slow
def test_a_stopped_process_catches_up_with_every_activation(
    started: list[Stalled], tmp_path: Path
) -> None:
    run = Stalled(tmp_path / "robot.stats", "catch-up")
    started.append(run)
    run.wait_for_activations(20)
    stood = run.stall()
    answer = run.result()
    counted = answer["statistics"]["models"]["imu"]
    assert answer["sent"] == [number * PERIOD for number in range(DUE)]
    assert (counted["run"], counted["skipped"], counted["coalesced"]) == (DUE, 0, 0)
    assert counted["overruns"] >= (stood - PERIOD // 10) // PERIOD
    assert answer["statistics"]["lateness_us"]["max"] * MICROSECOND >= stood - PERIOD


@pytest.mark.slow
def test_a_stopped_process_ends_safely_where_that_is_the_policy(
    started: list[Stalled], tmp_path: Path
) -> None:
    run = Stalled(tmp_path / "robot.stats", "stop")
    started.append(run)
    run.wait_for_activations(20)
    run.stall()
    answer = run.result()
    assert answer["state"] == "OVERRUN"
    assert answer["made_safe"] == 1
    assert answer["statistics"]["scheduled"] < DUE
    assert "its policy stops the run" in answer["statistics"]["conditions"]["run"]["reason"]


@pytest.mark.slow
@pytest.mark.parametrize("policy", ["skip", "catch-up"])
def test_a_busy_thread_beside_the_loop_is_accounted_for(
    started: list[Stalled], tmp_path: Path, policy: str
) -> None:
    run = Stalled(tmp_path / "robot.stats", policy, hog="busy")
    started.append(run)
    answer = run.result()
    counted = answer["statistics"]["models"]["imu"]
    assert counted["scheduled"] == DUE
    assert counted["overruns"] + counted["skipped"] >= 1
    if policy == "catch-up":
        assert answer["sent"] == [number * PERIOD for number in range(DUE)]


@pytest.mark.slow
@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="needs two processors")
def test_a_process_moved_between_processors_loses_no_activation(
    started: list[Stalled], tmp_path: Path
) -> None:
    run = Stalled(tmp_path / "robot.stats", "catch-up")
    started.append(run)
    allowed = sorted(os.sched_getaffinity(0))
    for activations in range(20, 400, 20):
        run.wait_for_activations(activations)
        os.sched_setaffinity(run.process.pid, {allowed[activations // 20 % len(allowed)]})
    answer = run.result()
    assert answer["sent"] == [number * PERIOD for number in range(DUE)]
    assert answer["statistics"]["run"] == DUE


@pytest.mark.slow
def test_readers_killed_at_any_instant_leave_the_loop_untouched(
    started: list[Stalled], tmp_path: Path
) -> None:
    run = Stalled(tmp_path / "robot.stats", "catch-up")
    started.append(run)
    run.wait_for_activations(1)
    reader = (
        "import sys; from pathlib import Path;"
        "from firmware_runtime.telemetry.statistics_reader import read_statistics\n"
        "print('reading', flush=True)\n"
        "while True: read_statistics(Path(sys.argv[1])).as_json()"
    )
    killed = 0
    while run.process.poll() is None and killed < 8:
        command = [sys.executable, "-c", reader, str(run.path)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as reading:
            assert reading.stdout is not None
            assert reading.stdout.readline() == "reading\n"
            run.wait_for_activations(read_statistics(run.path).as_json()["run"] + killed)
            reading.kill()
        killed += 1
    answer = run.result()
    assert killed > 0
    assert answer["sent"] == [number * PERIOD for number in range(DUE)]
