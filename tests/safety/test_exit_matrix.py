"""Every way to die, and how long until all outputs are off, on doubles that outlive the run.

The times go into a table (`docs/safety.md` is made of it, see there); what is asserted are the
goals, ten times over where only a loaded machine could miss them.
"""

import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from time import monotonic_ns

import pytest

from tests.support.guarded_run import COMMAND, GuardedRun, guarded_run, wait_until
from tests.support.safety_table import SafetyTable

pytestmark = pytest.mark.slow
SLACK = 10
"""A machine that runs other tests too may be so many times slower than the goal."""

BROKEN_MODEL = """
import sys
from firmware_runtime.cli.main import main
from boards.tachobot.attitude import Attitude
from pathlib import Path
from time import monotonic_ns
whole = Attitude.external
order = Path({order!r})
def external(self, elapsed):
    if order.exists():
        print("failing at", monotonic_ns(), flush=True)
        {fault}
    whole(self, elapsed)
Attitude.external = external
sys.exit(main(sys.argv[1:]))
"""
BROKEN_DRIVER = """
import sys
from firmware_runtime.cli.main import main
from drivers.chips.mpu9250 import Mpu9250
from pathlib import Path
from time import monotonic_ns
whole = Mpu9250.read_sample
order = Path({order!r})
def read_sample(self):
    if order.exists():
        print("failing at", monotonic_ns(), flush=True)
        raise TypeError("a driver's bug")
    return whole(self)
Mpu9250.read_sample = read_sample
sys.exit(main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def table() -> Iterator[SafetyTable]:
    table = SafetyTable()
    yield table
    table.keep()


def fail(run: GuardedRun, order: Path) -> int:
    """Let a run that drives fail; return when it said that it was about to."""
    order.touch()
    assert run.run.stdout is not None
    for line in run.run.stdout:
        if line.startswith("failing at"):
            return int(line.split()[-1])
    raise AssertionError("the run ended without failing")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT], ids=lambda each: each.name)
def test_a_signal_that_asks(tmp_path: Path, table: SafetyTable, number: signal.Signals) -> None:
    with guarded_run(tmp_path) as run:
        took = run.until_off_ms(run.signal(number))
        assert run.run.wait(30) == 128 + number
    table.add(number.name, took, goal_ms=100)
    assert took < 100 * SLACK


@pytest.mark.parametrize(
    ("name", "fault", "goal_ms"),
    [
        ("exception in a model", 'raise ValueError("a bug")', 100),
        ("os._exit", "import os; os._exit(7)", 300),
        ("SIGSEGV", "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", 300),
        ("infinite loop in a transition", "\n        while True: pass", 300),
    ],
)
def test_a_fault_in_a_model(
    tmp_path: Path, table: SafetyTable, name: str, fault: str, goal_ms: int
) -> None:
    order = tmp_path / "fail"
    program = BROKEN_MODEL.format(order=str(order), fault=fault)
    with guarded_run(tmp_path, program=program) as run:
        took = run.until_off_ms(fail(run, order))
    table.add(name, took, goal_ms)
    assert took < goal_ms * SLACK


def test_an_exception_in_a_driver(tmp_path: Path, table: SafetyTable) -> None:
    order = tmp_path / "fail"
    with guarded_run(tmp_path, program=BROKEN_DRIVER.format(order=str(order))) as run:
        took = run.until_off_ms(fail(run, order))
        assert run.run.wait(30) == 1
    table.add("exception in a driver", took, goal_ms=100)
    assert took < 100 * SLACK


def test_kill_9(tmp_path: Path, table: SafetyTable) -> None:
    with guarded_run(tmp_path) as run:
        took = run.until_off_ms(run.signal(signal.SIGKILL))
    table.add("SIGKILL", took, goal_ms=300)
    assert took < 300 * SLACK


def test_a_hang_and_what_comes_back_from_it(tmp_path: Path, table: SafetyTable) -> None:
    with guarded_run(tmp_path) as run:
        took = run.until_off_ms(run.signal(signal.SIGSTOP))
        run.signal(signal.SIGCONT)
        wait_until(lambda: "the guard took over" in run.errors(), "the run finds the takeover")
        asked = subprocess.run(
            [*COMMAND, "arm", "tachobot"],
            env=run.environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert asked.returncode == 5
        assert "refused" in asked.stderr
        assert run.is_off
        assert run.run.poll() is None
    table.add("SIGSTOP (hang)", took, goal_ms=300)
    assert took < 300 * SLACK


def test_a_broken_file_at_sighup_changes_nothing(tmp_path: Path) -> None:
    source = Path("boards/tachobot/board.toml").read_text()
    board = tmp_path / "board.toml"
    board.write_text(source)
    with guarded_run(tmp_path, board=str(board)) as run:
        board.write_text(source.replace("kp = 0.75", "kp = 0.5"))
        run.signal(signal.SIGHUP)
        wait_until(lambda: "controller.yaw.kp" in run.errors(), "a new gain is taken up")
        board.write_text("nothing = sound")
        run.signal(signal.SIGHUP)
        wait_until(lambda: "everything stays as it was" in run.errors(), "the file is refused")
        assert not run.is_off
        assert run.run.poll() is None


def test_a_guard_that_is_killed_first_disarms_the_run(tmp_path: Path, table: SafetyTable) -> None:
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        at = monotonic_ns()
        run.guard.kill()
        took = run.until_off_ms(at)
        assert "the guard is gone" in run.errors()
        assert run.run.poll() is None
    table.add("guard killed first", took, goal_ms=1000)
    assert took < 1000 * SLACK


def test_both_killed_and_then_exec_stop_post(tmp_path: Path, table: SafetyTable) -> None:
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        run.guard.kill()
        run.guard.wait(30)
        at = run.signal(signal.SIGKILL)
        run.run.wait(30)
        words = ["safe-state", "tachobot", "--doubles", str(run.socket), "--reason", "signal"]
        done = subprocess.run(
            [*COMMAND, *words], env=run.environment, capture_output=True, text=True, check=False
        )
        assert (done.returncode, done.stdout) == (0, "tachobot: all outputs off (signal)\n")
        took = run.until_off_ms(at)
    table.add("both killed, then ExecStopPost", took, goal_ms=2500)
    assert took < 2500 * SLACK


def test_without_a_guard_kill_9_leaves_the_outputs_on(tmp_path: Path) -> None:
    """What the guard is for: a PCA9685 keeps its last duties."""
    with guarded_run(tmp_path, guard=False) as run:
        run.signal(signal.SIGKILL)
        run.run.wait(30)
        assert not run.is_off
        assert run.socket.exists()
