"""Commanders, buses, chips and orders that are not what they were, or late: outputs stay off."""

import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from firmware_runtime.board import registry
from firmware_runtime.errors import ControlError, Status
from firmware_runtime.hal.i2c import GENERAL_CALL
from firmware_runtime.hal.served.client import ServedBus
from firmware_runtime.hal.served.connection import Connection
from firmware_runtime.links.control import ask
from firmware_runtime.runs.safe_state import SafeState
from tests.links.test_robot_end import impostor
from tests.support.guarded_run import GuardedRun, guarded_run, unhurried
from tests.support.trials import PATIENT
from tests.support.waiting import PATIENCE_S, wait_until

pytestmark = pytest.mark.slow

PROGRAM = """
import sys
from msgspec.structs import replace
from firmware_boards.tachobot import definition
definition.BOARD = replace(definition.BOARD, inputs={"yaw_reference": 0.5})
from firmware_runtime.cli.main import main
sys.exit(main(sys.argv[1:]))
"""
COMMANDER = """
import sys
from pathlib import Path
from threading import Event
from firmware_runtime.links.ports.ports_client import PortsClient
where = sys.argv[1]
with PortsClient(where if ":" in where else Path(where)) as robot:
    while True:
        robot.put("yaw_reference", 1.0)
        print("put", flush=True)
        Event().wait(0.05)
"""


@contextmanager
def commander(run: GuardedRun, where: str) -> Iterator[None]:
    """A process that commands the robot, and is killed at the end of the block."""
    with run.another(where, program=COMMANDER) as process:
        assert process.stdout is not None
        for _ in range(20):
            assert process.stdout.readline() == "put\n", run.errors()
        yield
        process.send_signal(signal.SIGKILL)


@contextmanager
def way(run: GuardedRun, tmp_path: Path, name: str) -> Iterator[str]:
    """Where the commander speaks to."""
    if name == "ports":
        yield str(tmp_path / "tachobot.stats")
        return
    with run.another("bridge", "tachobot", "--listen", "127.0.0.1:0") as bridge:
        assert bridge.stdout is not None
        found = bridge.stdout.readline().split()[-1]
        yield found


@pytest.mark.parametrize("name", ["ports", "bridge"])
def test_outputs_go_off_and_come_on_with_the_next_commander(tmp_path: Path, name: str) -> None:
    with guarded_run(tmp_path, guard=False, words=PATIENT, program=PROGRAM) as run:
        with way(run, tmp_path, name) as where:
            with commander(run, where):
                assert not run.is_off
            wait_until(lambda: run.is_off, "the outputs are off", run.errors)
            steps = run.steps()
            wait_until(lambda: run.steps() > steps + 200, "the run goes on", run.errors)
            assert run.is_off
            refused = run.ask("arm", "tachobot")
            assert "no value has come at input yaw_reference for 0.5 s" in refused.stderr
            with commander(run, where):
                wait_until(lambda: not run.is_off, "the motors are driven again", run.errors)
        run.signal(signal.SIGTERM)
        run.run.wait()
        recording = tmp_path / "tachobot.recording"
        found = run.ask("replay", recording, "--json")
    assert json.loads(found.stdout)["identical"] is True, found


SEND = "send tachobot yaw_reference=1"


def test_a_process_in_the_place_of_a_run_that_hangs_disarms_nothing(tmp_path: Path) -> None:
    with guarded_run(tmp_path, guard=False, words=PATIENT) as run:
        run.signal(signal.SIGSTOP)
        socket = tmp_path / "tachobot.socket"
        socket.unlink()
        with impostor(socket):
            for words in ("disarm tachobot", "arm", "set tachobot", SEND):
                done = run.ask(*words.split())
                assert done.returncode not in {Status.OK, Status.REFUSED}
                assert f"the run is process {run.run.pid}" in done.stderr
                assert "disarmed" not in done.stdout
        assert not run.is_off


SWITCH_OFF = ("--set", "executive.switch_off_s=5")


def outage(run: GuardedRun, lasts_s: float) -> None:
    """No chip answers from now on, for a while."""
    done = run.ask("doubles", "fault", "nack", "--for", lasts_s, "--socket", run.socket)
    assert done.returncode == 0, done.stderr


def ended(run: GuardedRun) -> int:
    """The run's exit status, once it has ended."""
    return run.run.wait(PATIENCE_S)


@pytest.mark.parametrize("robot", ["tachobot", "detective"])
def test_a_bus_that_comes_back_leaves_nothing_on(robot: str, tmp_path: Path) -> None:
    with guarded_run(tmp_path, robot=robot, guard=False, words=SWITCH_OFF) as run:
        outage(run, 0.6)
        run.signal(signal.SIGTERM)
        status = ended(run)
        # nothing writes to the chips any more; an MD25 that was stopped slows down for 25 ms
        wait_until(lambda: run.is_off, "all outputs are off", run.errors)
        assert status != 4
        assert "not made safe" not in run.errors()


def test_a_bus_that_stays_away_is_given_up_with_a_sentence(tmp_path: Path) -> None:
    words = ("--set", "executive.switch_off_s=0.1")
    with guarded_run(tmp_path, guard=False, words=words) as run:
        outage(run, 600)
        run.signal(signal.SIGTERM)
        assert ended(run) == 4
        assert "not made safe: i2c1" in run.errors()
        assert "given up" in run.errors()


PWM = 0x40
INVERTED, WAITS_FOR_FOUR_REGISTERS = b"\x01\x14", b"\x01\x0c"
RESET = b"\x06"
CHANGED = "it was reset or written to by another program"
IN_VAIN = "expected slowing down while it is driven by"


def write(run: GuardedRun, address: int, message: bytes) -> None:
    """What another program, or the chip's supply, does to it."""
    connection = Connection(run.socket, answer_s=PATIENCE_S)
    ServedBus("i2c1", connection.ask).write(address, message)
    connection.close()


def said(run: GuardedRun, reasons: tuple[str, ...]) -> bool:
    """Whether the statistics of the run give one of these."""
    statistics = run.ask("stats", "tachobot").stdout
    return any(each in statistics for each in reasons)


def was_off(run: GuardedRun, since: int) -> bool:
    """Whether every output was off at some instant of the log from that line on."""
    outputs: dict[str, float] = {}
    for number, line in enumerate(run.lines()):
        if "output" in line:
            outputs[line["output"]] = line["value"]
            if number >= since and not any(outputs.values()):
                return True
    return False


@pytest.mark.parametrize("mode2", [INVERTED, WAITS_FOR_FOUR_REGISTERS])
@pytest.mark.parametrize("end", ["SIGTERM", "SIGKILL", "safe-state"])
def test_no_end_leaves_on_what_full_off_alone_would_not_stop(
    tmp_path: Path, mode2: bytes, end: str
) -> None:
    with guarded_run(tmp_path) as run:
        write(run, PWM, mode2)
        if end == "safe-state":
            assert "all outputs off" in run.safe_state("requested")
        else:
            run.signal(signal.Signals[end])
            run.run.wait(PATIENCE_S)
            wait_until(lambda: run.is_off, "the guard has switched off", run.errors)
        assert run.is_off


@pytest.mark.parametrize(
    ("address", "message", "reasons"),
    [
        (GENERAL_CALL, RESET, (CHANGED,)),
        # It turns the other way, which may be found before its registers are looked at.
        (PWM, INVERTED, (CHANGED, IN_VAIN)),
        (PWM, WAITS_FOR_FOUR_REGISTERS, (CHANGED,)),
    ],
)
def test_what_it_changes_is_noticed_said_and_leaves_nothing_on(
    tmp_path: Path, address: int, message: bytes, reasons: tuple[str, ...]
) -> None:
    with guarded_run(tmp_path, guard=False) as run:  # it is the run that notices
        before = len(run.lines())
        write(run, address, message)
        wait_until(lambda: was_off(run, before), "it has been switched off", run.errors)
        # On a busy machine forces that came late may have switched it off before that.
        wait_until(lambda: said(run, reasons), "the run says so", run.errors)
        wait_until(lambda: not run.is_off, "the run has brought it up again", run.errors)
        run.signal(signal.SIGTERM)
        run.run.wait(PATIENCE_S)
        assert run.is_off


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
    with guarded_run(tmp_path, guard=False, words=PATIENT) as run:
        run.signal(signal.SIGSTOP)
        with suppress(ControlError):
            ask(tmp_path / "tachobot.stats", "arm", timeout_s=0.1)
        run.safe_state("requested")
        run.signal(signal.SIGCONT)
        wait_until(
            lambda: "safe-state took its right" in run.errors(), "the run knows it", run.errors
        )
        steps = run.steps()
        wait_until(lambda: run.steps() > steps + 100, "the run goes on", run.errors)
        assert run.is_off
        run.arm_again()


class Starting:
    """A run that is to arm itself, and is held while it finds its chips."""

    def __init__(self, directory: Path) -> None:
        self.wait = directory / "wait"
        self.starts = directory / "starts"
        self.program = SLOW_START.format(starts=str(self.starts), wait=str(self.wait))
        self.words = ("--for", "600", "--supervised", "--arm", *unhurried("tachobot"))

    def safe_state(self, run: GuardedRun) -> SafeState:
        """What has switched off a board that no run drove, and looked for one that may."""
        run.signal(signal.SIGTERM)
        run.run.wait(PATIENCE_S)
        self.starts.unlink()
        self.wait.touch()
        arguments = ("run", "tachobot", "--doubles", run.socket, *self.words)
        run.start_instead(*arguments, program=self.program)
        wait_until(self.starts.exists, "it finds its chips", run.errors)
        statistics = run.statistics
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
    with guarded_run(tmp_path, words=PATIENT) as run:
        run.signal(signal.SIGTERM)
        run.run.wait(PATIENCE_S)
        wait.touch()
        words = ("run", "tachobot", "--doubles", run.socket, "--for", "600", *unhurried("tachobot"))
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
