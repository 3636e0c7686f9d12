"""A run of another user: what may not be taken from it is not said to be off."""

import os
import subprocess
import sys
from collections.abc import Iterator
from fcntl import LOCK_EX, flock
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tests.support.guarded_run import guarded_run
from tests.support.trials import PATIENT
from tests.support.waiting import PATIENCE_S

ORDINARY = """
import os, sys
def become_ordinary():
    if os.geteuid() == 0:
        os.setgroups([])
        os.setgid(65534)
        os.setuid(65534)
"""
"""What root is not kept from, another user is."""
LOOK = f"""{ORDINARY}
from firmware_runtime.runs.active_runs import is_driven
become_ordinary()
print(is_driven(sys.argv[1:]))
"""
LOCK = f"""{ORDINARY}
from pathlib import Path
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.hal.served.connection import Connection
connection = Connection(Path(sys.argv[1]))
become_ordinary()
try:
    connection.keep_others_out()
except HalError as error:
    print(type(error).__name__, error)
"""
ASK = f"""{ORDINARY}
from pathlib import Path
from firmware_runtime.errors import FirmwareRuntimeError
from firmware_runtime.links.control import ask
from firmware_runtime.links.ports import robot_end  # while it may be read
from firmware_runtime.runs.watched_run import WatchedRun
path = Path(sys.argv[1])
become_ordinary()
for attempt in (lambda: ask(path, "disarm"), lambda: WatchedRun(path)):
    try:
        attempt()
    except FirmwareRuntimeError as error:
        print(error)
"""
SWITCH_OFF = f"""{ORDINARY}
from pathlib import Path
from time import monotonic_ns, sleep
from firmware_runtime.board import registry
from firmware_runtime.cli.commands.safe_state import _switch_off
from firmware_runtime.runs.safe_state import SafeState
meant, socket = [registry.load("tachobot")], Path(sys.argv[1])
SafeState(meant, socket, None).make_safe()  # so that all is imported while it may be read
become_ordinary()
print(_switch_off(SafeState(meant, socket, None), lambda: sleep(0.02)))
"""


def said(program: str, path: Path) -> str:
    done = subprocess.run(
        [sys.executable, "-c", program, str(path)],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
        cwd=Path(__file__).parents[2],
    )
    assert done.stderr == ""
    return done.stdout.strip()


@pytest.fixture
def everybodys() -> Iterator[Path]:
    """A folder that every user may look into."""
    with TemporaryDirectory() as name:
        Path(name).chmod(0o755)
        yield Path(name)


@pytest.mark.slow
@pytest.mark.parametrize("mode", [0o644, 0o444, 0o000])
def test_a_line_that_another_user_has_locked_is_driven(everybodys: Path, mode: int) -> None:
    line = everybodys / "line"
    line.touch()
    with line.open("rb") as held:
        flock(held, LOCK_EX)
        line.chmod(mode)
        assert said(LOOK, line) == "True"


@pytest.mark.slow
@pytest.mark.parametrize("mode", [0o666, 0o444])
def test_a_line_that_nothing_has_locked_is_not(everybodys: Path, mode: int) -> None:
    line = everybodys / "line"
    line.touch()
    line.chmod(mode)
    assert said(LOOK, line) == "False"


@pytest.mark.slow
@pytest.mark.skipif(os.geteuid() != 0, reason="becoming another user takes root")
def test_a_run_that_may_not_be_stopped_is_not_said_to_be_off(everybodys: Path) -> None:
    with guarded_run(everybodys, guard=False, words=PATIENT) as run:
        run.socket.chmod(0o777)
        assert said(LOCK, run.socket).startswith("BusInUse")
        refused = said(ASK, everybodys / "tachobot.stats").splitlines()
        assert len(refused) == 2
        assert all("expected the user of that run, or root" in each for each in refused)
        found = said(SWITCH_OFF, run.socket)
        assert not run.is_off
        assert "are on" in found
        assert "its right to drive cannot be taken from here" in found


@pytest.mark.slow
@pytest.mark.skipif(os.geteuid() != 0, reason="becoming another user takes root")
def test_a_run_that_may_not_be_stopped_is_named_before_it_is_armed(everybodys: Path) -> None:
    with guarded_run(everybodys, guard=False) as run:
        run.socket.chmod(0o777)
        assert run.ask("disarm", "tachobot").returncode == 0
        found = said(SWITCH_OFF, run.socket)
        assert run.is_off
        assert "its right to drive cannot be taken from here" in found
