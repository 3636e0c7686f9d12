"""Orders and runs that come too late to be known: after `safe-state` said off, all stays off."""

import signal
from contextlib import suppress
from pathlib import Path

import pytest

from firmware_runtime.board import registry
from firmware_runtime.errors import ControlError
from firmware_runtime.links.control import ask
from firmware_runtime.runs.safe_state import SafeState
from tests.support.guarded_run import UNHURRIED, GuardedRun, guarded_run
from tests.support.trials import TURNING
from tests.support.waiting import PATIENCE_S, wait_until

pytestmark = pytest.mark.slow
SLOW_START = """
import sys
from pathlib import Path
from select import select
from firmware_runtime.board.robot import Robot
find_chips = Robot.find_chips
def slow(robot):
    Path({starts!r}).touch()
    while Path({wait!r}).exists():
        select((), (), (), 0.005)
    find_chips(robot)
Robot.find_chips = slow
from firmware_runtime.cli.main import main
sys.exit(main(sys.argv[1:]))
"""
SLOW_IMPORT = """
import sys
from pathlib import Path
from select import select
Path({starts!r}).touch()
while Path({wait!r}).exists():
    select((), (), (), 0.005)
from firmware_runtime.cli.main import main
sys.exit(main(sys.argv[1:]))
"""
BROKEN_END = """
import resource, sys
from pathlib import Path
from firmware_boards.tachobot import definition
from firmware_boards.tachobot.wiring import Tachobot
from firmware_runtime.devs.atomic import Atomic

class Failing(Atomic):
    def initialize(self):
        self.hold_in("waiting", 10_000_000)

    def internal(self):
        if Path({order!r}).exists():
            resource.setrlimit(resource.RLIMIT_NOFILE, (0, 4096))
            raise ValueError("no descriptor can be polled any more")
        self.hold_in("waiting", 10_000_000)

class WithFailing(Tachobot):
    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.add(Failing("failing"))

definition.Tachobot = WithFailing
from firmware_runtime.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


def test_a_request_to_arm_that_a_stopped_run_finds_after_safe_state_is_refused(
    tmp_path: Path,
) -> None:
    with guarded_run(tmp_path, guard=False, words=TURNING) as run:
        run.signal(signal.SIGSTOP)
        with suppress(ControlError):
            ask(tmp_path / "tachobot.stats", "arm", timeout_s=0.1)
        run.safe_state("requested")
        run.signal(signal.SIGCONT)
        wait_until(lambda: "safe-state took its right" in run.errors(), "the run knows it")
        steps = run.steps()
        wait_until(lambda: run.steps() > steps + 100, "the run goes on")
        assert run.is_off
        run.arm_again()


class Starting:
    """A run that is to arm itself, and is held while it finds its chips."""

    def __init__(self, directory: Path) -> None:
        self.wait = directory / "wait"
        self.starts = directory / "starts"
        self.program = SLOW_START.format(starts=str(self.starts), wait=str(self.wait))
        self.words = ("--for", "600", "--supervised", "--arm", *UNHURRIED)

    def safe_state(self, run: GuardedRun) -> SafeState:
        """What has switched off a board that no run drove, and looked for one that may."""
        run.signal(signal.SIGTERM)
        run.run.wait(PATIENCE_S)
        self.starts.unlink()
        self.wait.touch()
        arguments = ("run", "tachobot", "--doubles", run.socket, *self.words)
        run.start_instead(*arguments, program=self.program)
        wait_until(self.starts.exists, "it finds its chips", run.errors)
        statistics = run.log.with_name("tachobot.stats")
        safe_state = SafeState([registry.load("tachobot")], run.socket, statistics)
        safe_state.take_right()
        assert safe_state.make_safe() == []
        safe_state.find_runs()
        return safe_state


@pytest.fixture
def starting(tmp_path: Path) -> Starting:
    return Starting(tmp_path)


def test_a_run_that_starts_meanwhile_does_not_arm_itself(
    tmp_path: Path, starting: Starting
) -> None:
    with guarded_run(tmp_path, program=starting.program) as run:
        safe_state = starting.safe_state(run)
        assert not safe_state.has_acknowledged()
        starting.wait.unlink()
        wait_until(safe_state.has_acknowledged, "the run knows it", run.errors)
        assert "stays disarmed: safe-state took its right to drive" in run.errors()
        safe_state.close()
        steps = run.steps()
        wait_until(lambda: run.steps() > steps + 600, "it would have armed itself")
        assert run.is_off


def test_a_run_that_has_not_come_so_far_is_named(tmp_path: Path, starting: Starting) -> None:
    with guarded_run(tmp_path, program=starting.program) as run:
        starting.safe_state(run).close()
        done = run.ask("safe-state", "tachobot", "--doubles", run.socket)
        assert done.returncode == 0
        assert f"process {run.run.pid} (" in done.stderr
        assert "it may still drive, as a run that starts" in done.stderr


def test_a_run_that_has_opened_nothing_yet_does_not_arm_itself(tmp_path: Path) -> None:
    """It still imports: `safe-state` finds no lines, no statistics and nothing that is on."""
    starts, wait = tmp_path / "starts", tmp_path / "wait"
    program = SLOW_IMPORT.format(starts=str(starts), wait=str(wait))
    with guarded_run(tmp_path) as run:
        run.signal(signal.SIGTERM)
        run.run.wait(PATIENCE_S)
        wait.touch()
        words = ("run", "tachobot", "--doubles", run.socket, "--for", "600", *UNHURRIED)
        run.start_instead(*words, "--supervised", "--arm", program=program)
        wait_until(starts.exists, "it begins", run.errors)
        run.safe_state("requested")
        wait.unlink()
        stays = "stays disarmed: safe-state took its right to drive"
        wait_until(lambda: stays in run.errors(), "the run knows it", run.errors)
        steps = run.steps()
        wait_until(lambda: run.steps() > steps + 600, "it would have armed itself")
        assert run.is_off
        run.arm_again()
        run.signal(signal.SIGTERM)
        run.run.wait(PATIENCE_S)
        run.run_again()  # it begins after safe-state, and drives


def test_what_a_run_cannot_switch_off_at_its_end_the_guard_does(tmp_path: Path) -> None:
    order = tmp_path / "fail"
    program = BROKEN_END.format(order=str(order))
    with guarded_run(tmp_path, program=program) as run:
        order.touch()
        wait_until(lambda: bool(run.takeovers()), "the guard has taken over", run.errors)
        assert run.takeovers()[0]["why"].startswith("no finished step")
        assert run.is_off
