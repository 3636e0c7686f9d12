"""Stalls of the machine, in real time: what they cost must be in the accounts, by policy.

Other programs stall the run too, so at least the injected stall must be there; the sums are exact.
"""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from time import monotonic_ns
from typing import Any

import pytest

from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, SECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.statistics.reader import read_statistics
from tests.support.waiting import PATIENCE_S, wait_until

pytestmark = [pytest.mark.slow, pytest.mark.real_time]
PERIOD = 2 * MILLISECOND
STALL_S = 0.5

PROGRAM = """
import json, signal, sys, threading
from pathlib import Path
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.policy import ActivationPolicy
from tests.support.periodic_models import Robot
from tests.executive.test_real_stalls import PERIOD, busy

path, policy, stop_after_us, hog = sys.argv[1:]
robot = Robot(imu=PERIOD)
limit = float(stop_after_us) if policy == "stop" else None
policies = {"imu": ActivationPolicy(policy, stop_after_us=limit)}
configuration = Configuration(policies=policies, statistics_path=Path(path))
made_safe = []
executive = Executive(robot, MonotonicClock(), lambda: made_safe.append(1) or [], configuration)
signal.signal(signal.SIGTERM, lambda *_: executive.request_stop("enough"))
sent = []
def note(at, value):
    sent.append(at)
    if hog == "busy" and len(sent) == 10:
        threading.Thread(target=busy, args=(300_000_000,), daemon=True).start()
executive.simulator.listen(robot.imu.sample, note)
outcome = executive.run()
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
    """A run in a process of its own, until it is asked to end."""

    def __init__(self, path: Path, policy: str = "skip", hog: str = "") -> None:
        self.path = path
        command = [sys.executable, "-c", PROGRAM, str(path), policy, "300000", hog]
        root = Path(__file__).parents[2]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=root)

    def wait_for_activations(self, count: int) -> None:
        """Return when so many have run, or the run is over."""
        wait_until(lambda: self.has_ended or self.activations() >= count, f"{count} activations")

    @property
    def has_ended(self) -> bool:
        """Whether there are no more activations to come."""
        return self.process.poll() is not None

    def activations(self) -> int:
        """How many have run by now; none where that cannot be read at this moment."""
        try:
            ran: int = read_statistics(self.path).as_json()["run"]
        except StatisticsFileError:
            return 0
        return ran

    def wait_for_more(self, activations: int) -> None:
        """Return when so many more have run."""
        self.wait_for_activations(self.activations() + activations)

    def stall(self) -> int:
        """Stop the process for the time of a stall; return how long it stood at least, in ns."""
        self.process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, self.process.pid, os.WSTOPPED | os.WEXITED | os.WNOWAIT)
        stopped_at = monotonic_ns()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(timeout=STALL_S)
        stood = monotonic_ns() - stopped_at
        self.process.send_signal(signal.SIGCONT)
        return stood

    def result(self) -> dict[str, Any]:
        """What the run counted, once it has ended; it is asked to, if it goes on."""
        self.process.terminate()
        said, _ = self.process.communicate(timeout=PATIENCE_S)
        assert self.process.returncode == 0
        answer: dict[str, Any] = json.loads(said)
        counted = answer["statistics"]["models"]["imu"]
        assert counted["scheduled"] == counted["run"] + counted["skipped"] + counted["coalesced"]
        assert counted["run"] == answer["activations"]
        assert all(at % PERIOD == 0 for at in answer["sent"])
        assert len(set(answer["sent"])) == len(answer["sent"])
        return answer


def due(answer: dict[str, Any]) -> int:
    """How many activations the clock says there were."""
    elapsed_s: float = answer["statistics"]["conditions"]["run"]["elapsed_s"]
    return round(elapsed_s * SECOND) // PERIOD + 1


@pytest.fixture
def started() -> Iterator[list[Stalled]]:
    runs: list[Stalled] = []
    yield runs
    for run in runs:
        run.process.kill()
        run.process.communicate()


def test_a_stopped_process_skips_what_it_missed_and_keeps_its_phase(
    started: list[Stalled], tmp_path: Path
) -> None:
    run = Stalled(tmp_path / "robot.stats", "skip")
    started.append(run)
    run.wait_for_activations(20)
    stood = run.stall()
    run.wait_for_more(20)
    answer = run.result()
    counted = answer["statistics"]["models"]["imu"]
    assert answer["state"] == "STOPPED"
    assert counted["scheduled"] == due(answer)
    assert counted["skipped"] >= stood // PERIOD - 1
    assert counted["overruns"] >= 1
    assert counted["episodes"] <= counted["overruns"] + counted["skipped"]
    assert answer["statistics"]["lateness_us"]["max"] * MICROSECOND >= stood - PERIOD


def test_a_stopped_process_catches_up_with_every_activation(
    started: list[Stalled], tmp_path: Path
) -> None:
    run = Stalled(tmp_path / "robot.stats", "catch-up")
    started.append(run)
    run.wait_for_activations(20)
    stood = run.stall()
    run.wait_for_more(stood // PERIOD + 20)
    answer = run.result()
    counted = answer["statistics"]["models"]["imu"]
    assert_none_is_missing(answer)
    assert (counted["scheduled"], counted["coalesced"]) == (due(answer), 0)
    assert counted["overruns"] >= (stood - PERIOD // 10) // PERIOD
    assert answer["statistics"]["lateness_us"]["max"] * MICROSECOND >= stood - PERIOD


def assert_none_is_missing(answer: dict[str, Any]) -> None:
    """Every activation up to the last one that ran has run."""
    assert answer["sent"] == [number * PERIOD for number in range(len(answer["sent"]))]


def test_a_stopped_process_ends_safely_where_that_is_the_policy(
    started: list[Stalled], tmp_path: Path
) -> None:
    """A machine that stalls it by itself may end it before: the same end."""
    run = Stalled(tmp_path / "robot.stats", "stop")
    started.append(run)
    run.wait_for_activations(20)
    if not run.has_ended:
        run.stall()
        wait_until(lambda: run.has_ended, "the policy ends the run")
    answer = run.result()
    assert answer["state"] == "OVERRUN"
    assert answer["made_safe"] == 2
    assert "its policy stops the run" in answer["statistics"]["conditions"]["run"]["reason"]


@pytest.mark.parametrize("policy", ["skip", "catch-up"])
def test_a_busy_thread_beside_the_loop_is_accounted_for(
    started: list[Stalled], tmp_path: Path, policy: str
) -> None:
    run = Stalled(tmp_path / "robot.stats", policy, hog="busy")
    started.append(run)
    run.wait_for_activations(200)
    answer = run.result()
    counted = answer["statistics"]["models"]["imu"]
    assert counted["scheduled"] == due(answer)
    assert counted["overruns"] + counted["skipped"] >= 1
    if policy == "catch-up":
        assert_none_is_missing(answer)


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="needs two processors")
def test_a_process_moved_between_processors_loses_no_activation(
    started: list[Stalled], tmp_path: Path
) -> None:
    run = Stalled(tmp_path / "robot.stats", "catch-up")
    started.append(run)
    allowed = sorted(os.sched_getaffinity(0))
    for move in range(20):
        run.wait_for_more(20)
        os.sched_setaffinity(run.process.pid, {allowed[move % len(allowed)]})
    answer = run.result()
    assert_none_is_missing(answer)
    assert len(answer["sent"]) >= 400


def test_readers_killed_at_any_instant_leave_the_loop_untouched(
    started: list[Stalled], tmp_path: Path
) -> None:
    run = Stalled(tmp_path / "robot.stats", "catch-up")
    started.append(run)
    run.wait_for_activations(1)
    reader = (
        "import sys; from pathlib import Path;"
        "from firmware_runtime.statistics.reader import read_statistics\n"
        "print('reading', flush=True)\n"
        "while True: read_statistics(Path(sys.argv[1])).as_json()"
    )
    for killed in range(8):
        command = [sys.executable, "-c", reader, str(run.path)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as reading:
            try:
                assert reading.stdout is not None
                assert reading.stdout.readline() == "reading\n"
                run.wait_for_more(killed)
            finally:
                reading.kill()  # or leaving the block would wait for it without end
    answer = run.result()
    assert_none_is_missing(answer)
    assert answer["state"] == "STOPPED"
