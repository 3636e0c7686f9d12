"""The process that commands a robot dies: its outputs go off, by whatever way it spoke."""

import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support.guarded_run import GuardedRun, guarded_run, wait_until
from tests.support.trials import TURNING

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
