"""Commanders, buses and chips that are not what they were: outputs go off."""

import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from firmware_runtime.errors import Status
from firmware_runtime.hal.i2c import GENERAL_CALL
from firmware_runtime.hal.served.client import ServedBus
from firmware_runtime.hal.served.connection import Connection
from tests.links.test_robot_end import impostor
from tests.support.guarded_run import GuardedRun, guarded_run
from tests.support.trials import TURNING
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
    with guarded_run(tmp_path, guard=False, words=TURNING, program=PROGRAM) as run:
        with way(run, tmp_path, name) as where:
            with commander(run, where):
                assert not run.is_off
            wait_until(lambda: run.is_off, "the outputs are off", run.errors)
            steps = run.steps()
            wait_until(lambda: run.steps() > steps + 200, "the run goes on")
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
    with guarded_run(tmp_path, guard=False, words=TURNING) as run:
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


def write(run: GuardedRun, address: int, message: bytes) -> None:
    """What another program, or the chip's supply, does to it."""
    connection = Connection(run.socket, answer_s=PATIENCE_S)
    ServedBus("i2c1", connection.ask).write(address, message)
    connection.close()


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
    ("address", "message"),
    [(GENERAL_CALL, RESET), (PWM, INVERTED), (PWM, WAITS_FOR_FOUR_REGISTERS)],
)
def test_what_it_changes_is_noticed_said_and_leaves_nothing_on(
    tmp_path: Path, address: int, message: bytes
) -> None:
    with guarded_run(tmp_path, guard=False) as run:  # it is the run that notices
        before = len(run.lines())
        write(run, address, message)
        wait_until(lambda: was_off(run, before), "it has been switched off", run.errors)
        # On a busy machine forces that came late may have switched it off before that.
        wait_until(
            lambda: CHANGED in run.ask("stats", "tachobot").stdout, "the run says so", run.errors
        )
        wait_until(lambda: not run.is_off, "the run has brought it up again", run.errors)
        run.signal(signal.SIGTERM)
        run.run.wait(PATIENCE_S)
        assert run.is_off
