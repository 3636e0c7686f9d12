"""Every way to die, and how long until all outputs are off, on doubles that outlive the run.

What is asserted is that they go off, what was said, and how the processes ended. The times go into
the table of `docs/safety.md`, beside their goals, if the tests are asked to write it (see
tests/support/safety_table.py): a busy machine changes a time, and must not fail a test.
"""

import signal
from collections.abc import Iterator
from pathlib import Path
from socket import AF_UNIX, SOCK_DGRAM, socket
from time import monotonic_ns

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.links.control import ask
from tests.support.guarded_run import GuardedRun, guarded_run
from tests.support.memory_limit import enter, killed_by_memory, memory_limit
from tests.support.safety_table import SafetyTable
from tests.support.trials import PATIENT
from tests.support.waiting import PATIENCE_S, wait_until

pytestmark = pytest.mark.slow


class Supervisor:
    """Listens where NOTIFY_SOCKET says and waits until no sign of life comes any more."""

    def __init__(self, path: Path, watchdog_ns: int) -> None:
        self.environment = {"NOTIFY_SOCKET": str(path), "WATCHDOG_USEC": str(watchdog_ns // 1000)}
        self._watchdog_ns = watchdog_ns
        self._socket = socket(AF_UNIX, SOCK_DGRAM)
        self._socket.bind(str(path))

    def wait_for_the_watchdog(self) -> None:
        """Return when no `WATCHDOG=1` has come for the time of the watchdog."""
        self._take_what_waits()
        expires_at = monotonic_ns() + self._watchdog_ns
        while (left := expires_at - monotonic_ns()) > 0:
            self._socket.settimeout(left / 1e9)
            try:
                said = self._socket.recv(65536)
            except TimeoutError:
                return
            if b"WATCHDOG=1" in said.splitlines():
                expires_at = monotonic_ns() + self._watchdog_ns

    def close(self) -> None:
        """Stop listening."""
        self._socket.close()

    def _take_what_waits(self) -> None:
        """What was said before is no sign of life now; some of it must have been one."""
        self._socket.setblocking(False)
        said = []
        try:
            while True:
                said.append(self._socket.recv(65536))
        except BlockingIOError:
            assert any(b"WATCHDOG=1" in each.splitlines() for each in said)


WATCHDOG_NS = 2 * SECOND
"""WatchdogSec of the unit."""
JUDGED = (
    *PATIENT,
    *("--set", "controller.period_s=0.05"),
    *("--set", "arming.max_late_percent=99"),
)
"""No later than a period that is longer than other programs delay a step, shorter than a hang."""
ENABLE_LINE = """
[output_enable]
chip = "/dev/gpiochip0"
line = 17
"""
BROKEN_MODEL = """
import sys
from firmware_runtime.cli.main import main
from firmware_boards.tachobot.attitude import Attitude
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
from firmware_drivers.chips.mpu9250 import Mpu9250
from pathlib import Path
from time import monotonic_ns
whole = Mpu9250.read_sample
order = Path({order!r})
def read_sample(self, rate_bias):
    if order.exists():
        print("failing at", monotonic_ns(), flush=True)
        raise TypeError("a driver's bug")
    return whole(self, rate_bias)
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


@pytest.mark.parametrize(
    ("number", "status"),
    [
        (signal.SIGTERM, 143),
        (signal.SIGINT, 130),
        (signal.SIGQUIT, 143),
        (signal.SIGTSTP, 143),
        (signal.SIGUSR1, 143),
    ],
)
def test_a_signal_that_asks(
    tmp_path: Path, table: SafetyTable, number: signal.Signals, status: int
) -> None:
    with guarded_run(tmp_path) as run:
        took = run.until_off_ms(run.signal(number))
        assert run.run.wait(PATIENCE_S) == status
    table.add(number.name, took, goal_ms=100)


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


def test_an_exception_in_a_driver(tmp_path: Path, table: SafetyTable) -> None:
    order = tmp_path / "fail"
    with guarded_run(tmp_path, program=BROKEN_DRIVER.format(order=str(order))) as run:
        took = run.until_off_ms(fail(run, order))
        assert run.run.wait(PATIENCE_S) == 1
    table.add("exception in a driver", took, goal_ms=100)


def test_kill_9(tmp_path: Path, table: SafetyTable) -> None:
    with guarded_run(tmp_path) as run:
        took = run.until_off_ms(run.signal(signal.SIGKILL))
    table.add("SIGKILL", took, goal_ms=300)


def test_a_hang_and_what_comes_back_from_it(tmp_path: Path, table: SafetyTable) -> None:
    with guarded_run(tmp_path, words=JUDGED) as run:
        took = run.until_off_ms(run.signal(signal.SIGSTOP))
        run.signal(signal.SIGCONT)
        wait_until(lambda: "the guard took over" in run.errors(), "the run finds the takeover")
        assert ask(tmp_path / "tachobot.stats", "arm")["refused"]
        assert run.is_off
        assert run.run.poll() is None
    table.add("SIGSTOP (hang)", took, goal_ms=300)


def test_a_broken_file_at_sighup_changes_nothing(tmp_path: Path) -> None:
    source = Path("boards/firmware_boards/tachobot/board.toml").read_text()
    board = tmp_path / "board.toml"
    board.write_text(source)
    with guarded_run(tmp_path, board=str(board), guard=False, words=PATIENT) as run:
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
        wait_until(lambda: "the guard is gone" in run.errors(), "the run says why")
        assert run.run.poll() is None
    table.add("guard killed first", took, goal_ms=1000)


def test_both_killed_and_then_exec_stop_post(tmp_path: Path, table: SafetyTable) -> None:
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        run.guard.kill()
        run.guard.wait(PATIENCE_S)
        at = run.signal(signal.SIGKILL)
        run.run.wait(PATIENCE_S)
        assert run.safe_state("signal") == "tachobot: all outputs off (signal)\n"
        took = run.until_off_ms(at)
    table.add("both killed, then ExecStopPost", took, goal_ms=2500)


def test_both_hang_and_the_watchdog_ends_it(tmp_path: Path, table: SafetyTable) -> None:
    """The test stands for systemd: WatchdogSec, SIGABRT and SIGCONT, ExecStopPost."""
    supervisor = Supervisor(tmp_path / "notify", WATCHDOG_NS)
    with guarded_run(tmp_path, environment=supervisor.environment) as run:
        assert run.guard is not None
        run.guard.send_signal(signal.SIGSTOP)
        at = run.signal(signal.SIGSTOP)
        supervisor.wait_for_the_watchdog()
        run.signal(signal.SIGABRT)
        run.signal(signal.SIGCONT)
        assert run.run.wait(PATIENCE_S) == -signal.SIGABRT
        assert run.safe_state("watchdog") == "tachobot: all outputs off (watchdog)\n"
        took = run.until_off_ms(at)
    supervisor.close()
    table.add("both hang (watchdog, ExecStopPost)", took, goal_ms=2500)
    assert took > WATCHDOG_NS / 1e6 / 2


def test_an_out_of_memory_kill(tmp_path: Path, table: SafetyTable) -> None:
    order = tmp_path / "fail"
    fault = '\n        kept = []\n        while True: kept.append(b"x" * 1_000_000)'
    program = BROKEN_MODEL.format(order=str(order), fault=fault)
    with memory_limit(256 << 20) as group, guarded_run(tmp_path, program=program) as run:
        enter(group, run.run.pid)
        took = run.until_off_ms(fail(run, order))
        assert run.run.wait(PATIENCE_S) == -signal.SIGKILL
        assert killed_by_memory(group) == 1
    table.add("out-of-memory kill", took, goal_ms=300)


@pytest.mark.parametrize("robot", ["tachobot", "detective"])
def test_a_bus_that_is_stuck_while_stopping(tmp_path: Path, table: SafetyTable, robot: str) -> None:
    """The run gives up and says so; the guard goes on until the bus is free again."""
    stuck_ns = 5 * SECOND
    with guarded_run(tmp_path, robot=robot) as run:
        words = ["--socket", run.socket, "--for", stuck_ns // SECOND]
        assert run.ask("doubles", "fault", "stuck", *words).returncode == 0
        run.signal(signal.SIGTERM)
        assert run.run.wait(PATIENCE_S) == 4
        assert "not made safe" in run.errors()
        assert not run.is_off
        took = run.until_off_ms(run.fault_ends_at())
        wait_until(
            lambda: run.takeovers()[-1]["off_after_ns"] is not None, "the guard's takeover is over"
        )
    table.add(f"bus stuck while stopping, {robot}: since it is free", took, goal_ms=300)


@pytest.mark.parametrize(
    ("number", "goal_ms"), [(signal.SIGTERM, 100), (signal.SIGKILL, 300), (signal.SIGSTOP, 300)]
)
def test_the_detective_robot_stops_too(
    tmp_path: Path, table: SafetyTable, number: signal.Signals, goal_ms: int
) -> None:
    with guarded_run(tmp_path, robot="detective") as run:
        took = run.until_off_ms(run.signal(number))
    table.add(f"{number.name}, detective", took, goal_ms)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL], ids=lambda each: each.name)
def test_an_enable_line_needs_no_guard(
    tmp_path: Path, table: SafetyTable, number: signal.Signals
) -> None:
    """The kernel frees the line of a process that ends; the resistor at OE does the rest."""
    board = tmp_path / "board.toml"
    board.write_text(Path("boards/firmware_boards/tachobot/board.toml").read_text() + ENABLE_LINE)
    with guarded_run(tmp_path, board=str(board), guard=False) as run:
        took = run.until_off_ms(run.signal(number))
        run.run.wait(PATIENCE_S)
    table.add(f"{number.name}, enable line, no guard", took, goal_ms=100)


def test_why_the_guard_took_over_is_kept(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        pid = run.run.pid
        run.signal(signal.SIGKILL)
        ended = f"process {pid} has ended"
        wait_until(lambda: ended in [each["why"] for each in run.takeovers()], "it is noted")
        assert run.takeovers()[-1]["writer"]["pid"] == pid
        shown = run.ask("stats", "tachobot").stdout
        assert f"guard: {ended}; all outputs off after" in shown


def test_a_second_run_on_the_same_doubles_is_refused(tmp_path: Path) -> None:
    with guarded_run(tmp_path, guard=False, words=PATIENT) as run:
        second = run.ask(
            "run", "tachobot", "--doubles", run.socket, "--statistics", tmp_path / "second.stats"
        )
        assert (second.returncode, second.stdout) == (3, "")
        assert "driven by another process" in second.stderr
        assert run.run.poll() is None
        assert not run.is_off


def test_without_a_guard_kill_9_leaves_the_outputs_on(tmp_path: Path) -> None:
    """What the guard is for: a PCA9685 keeps its last duties."""
    with guarded_run(tmp_path, guard=False, words=PATIENT) as run:
        run.signal(signal.SIGKILL)
        run.run.wait(PATIENCE_S)
        assert not run.is_off
        assert run.socket.exists()
