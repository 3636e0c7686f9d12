"""`safe-state` while something drives, whatever process and user drove it."""

import os
import signal
from collections.abc import Iterator
from contextlib import ExitStack
from fcntl import LOCK_EX, flock
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from firmware_runtime.board import registry
from tests.support.command import in_python
from tests.support.guarded_run import GuardedRun, as_fifo, guarded_run
from tests.support.trials import PATIENT
from tests.support.waiting import PATIENCE_S, wait_until

OLDER = """
import sys
from msgspec.structs import force_setattr
from firmware_runtime.statistics.file import STATISTICS
force_setattr(STATISTICS, "schema", STATISTICS.schema - 1)
from firmware_runtime.cli.main import main
sys.exit(main(sys.argv[1:]))
"""
STRANGER = """
import sys
from pathlib import Path
from time import sleep
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_runtime.hal.served.client import ServedBus
from firmware_runtime.hal.served.connection import Connection
chip = Pca9685(ServedBus("i2c1", Connection(Path(sys.argv[1])).ask))
chip.is_running = True
while True:
    chip.set_duties(0, [0.5])
    sleep(0.001)
"""


def safe_state(run: GuardedRun, *words: object) -> tuple[int, str]:
    """Exit status, and what was said on standard error."""
    done = run.ask("safe-state", *(words or (run.robot,)), "--doubles", run.socket)
    return done.returncode, done.stderr


def assert_stays_off(run: GuardedRun) -> None:
    """The run has gone on for some hundred steps, and nothing was driven again."""
    changes = len(run.lines())
    steps = run.steps()
    wait_until(lambda: run.steps() > steps + 100, "the run goes on", run.errors)
    assert run.is_off
    assert len([line for line in run.lines()[changes:] if "output" in line]) == 0


@pytest.mark.slow
def test_a_run_that_lives_is_disarmed_and_stays_so_until_it_is_armed_again(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        assert safe_state(run) == (0, "")
        wait_until(
            lambda: "safe-state took its right" in run.errors(), "the run says why", run.errors
        )
        assert_stays_off(run)
        assert (tmp_path / "tachobot.settings").exists()
        run.arm_again()


@pytest.mark.slow
def test_a_run_that_is_not_supervised_is_stopped_too(tmp_path: Path) -> None:
    with guarded_run(tmp_path, guard=False, supervised=False) as run:
        assert safe_state(run) == (0, "")
        assert_stays_off(run)


@pytest.mark.slow
def test_a_run_with_its_statistics_elsewhere_is_found(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    statistics = tmp_path / "elsewhere" / "mine.stats"
    with guarded_run(tmp_path, guard=False, words=["--statistics", str(statistics)]) as run:
        statistics.unlink()
        assert safe_state(run) == (0, "")
        wait_until(
            lambda: "safe-state took its right" in run.errors(), "the run knows it", run.errors
        )
        assert run.is_off


@pytest.mark.slow
def test_a_run_whose_file_was_replaced_by_a_copy_is_found(tmp_path: Path) -> None:
    statistics = tmp_path / "tachobot.stats"
    with guarded_run(tmp_path, guard=False) as run:
        whole = statistics.read_bytes()
        statistics.unlink()
        statistics.write_bytes(whole)
        assert safe_state(run) == (0, "")
        wait_until(
            lambda: "safe-state took its right" in run.errors(), "the run knows it", run.errors
        )
        assert run.is_off


@pytest.mark.slow
def test_a_run_that_is_stopped_is_off_and_comes_back_disarmed(tmp_path: Path) -> None:
    with guarded_run(tmp_path, guard=False) as run:
        steps = run.steps()
        wait_until(lambda: run.steps() > steps + 300, "it is certain where the robot was at first")
        run.signal(signal.SIGSTOP)
        status, said = safe_state(run)
        assert (status, run.is_off) == (0, True)
        assert f"process {run.run.pid} has not acknowledged" in said
        run.signal(signal.SIGCONT)
        wait_until(
            lambda: "safe-state took its right" in run.errors(), "the run knows it", run.errors
        )
        assert_stays_off(run)


@pytest.mark.slow
def test_a_run_of_another_version_is_asked_to_disarm(tmp_path: Path) -> None:
    with guarded_run(tmp_path, guard=False, program=OLDER) as run:
        assert safe_state(run) == (0, "")
        wait_until(lambda: "disarmed: requested" in run.errors(), "the run has disarmed")
        assert run.is_off


@pytest.mark.slow
def test_several_at_once_and_the_guard_do_not_disturb_each_other(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run, ExitStack() as stack:
        words = ("safe-state", "tachobot", "--doubles", run.socket)
        several = [stack.enter_context(run.another(*words)) for _ in range(3)]
        assert [each.wait(PATIENCE_S) for each in several] == [0, 0, 0]
        assert_stays_off(run)


@pytest.mark.slow
def test_what_something_else_drives_on_is_named(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        with run.another(str(run.socket), program=STRANGER) as stranger:
            as_fifo(stranger.pid, 98)  # it drives whatever else runs
            wait_until(lambda: run.outputs()["thrust_pairs.0"] == 0.5, "the stranger drives")
            status, said = safe_state(run)
        assert status == 4
        assert "PCA9685 at 0x40 on i2c1: outputs 0 are on" in said


@pytest.mark.slow
@pytest.mark.parametrize("where", ["at its place", "elsewhere"])
def test_a_broken_file_that_is_not_named_after_its_board_is_no_excuse(
    tmp_path: Path, where: str
) -> None:
    file = tmp_path / "mine.toml"
    file.write_bytes(registry.load("tachobot").source.read_bytes())
    elsewhere = where == "elsewhere"
    words = ["--statistics", str(tmp_path / "other" / "x.stats")] if elsewhere else []
    with guarded_run(tmp_path, board=str(file), guard=False, words=words) as run:
        file.write_text("[imu")
        status, said = safe_state(run, file)
        assert (status, run.is_off) == (0, True)
        assert "its last run's settings were taken instead" in said
        file.unlink()
        if not elsewhere:
            run.run.kill()
            run.run.wait(PATIENCE_S)
        assert safe_state(run, file)[0] == 0


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
    done = in_python(program, path, cwd=Path(__file__).parents[2])
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
