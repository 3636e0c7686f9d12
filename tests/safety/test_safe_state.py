"""`safe-state` while something drives: off is what stays off, whatever process drove it."""

import signal
from contextlib import ExitStack
from pathlib import Path

import pytest

from firmware_runtime.board import registry
from tests.support.guarded_run import GuardedRun, as_fifo, guarded_run, wait_until
from tests.support.waiting import PATIENCE_S

pytestmark = pytest.mark.slow
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
    wait_until(lambda: run.steps() > steps + 100, "the run goes on")
    assert run.is_off
    assert len([line for line in run.lines()[changes:] if "output" in line]) == 0


def test_a_run_that_lives_is_disarmed_and_stays_so_until_it_is_armed_again(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        assert safe_state(run) == (0, "")
        wait_until(lambda: "safe-state took its right" in run.errors(), "the run says why")
        assert_stays_off(run)
        assert (tmp_path / "tachobot.settings").exists()
        run.arm_again()


def test_a_run_that_is_not_supervised_is_stopped_too(tmp_path: Path) -> None:
    with guarded_run(tmp_path, guard=False, supervised=False) as run:
        assert safe_state(run) == (0, "")
        assert_stays_off(run)


def test_a_run_with_its_statistics_elsewhere_is_found(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    statistics = tmp_path / "elsewhere" / "mine.stats"
    with guarded_run(tmp_path, guard=False, words=["--statistics", str(statistics)]) as run:
        statistics.unlink()
        assert safe_state(run) == (0, "")
        wait_until(lambda: "safe-state took its right" in run.errors(), "the run knows it")
        assert run.is_off


def test_a_run_whose_file_was_replaced_by_a_copy_is_found(tmp_path: Path) -> None:
    statistics = tmp_path / "tachobot.stats"
    with guarded_run(tmp_path, guard=False) as run:
        whole = statistics.read_bytes()
        statistics.unlink()
        statistics.write_bytes(whole)
        assert safe_state(run) == (0, "")
        wait_until(lambda: "safe-state took its right" in run.errors(), "the run knows it")
        assert run.is_off


def test_a_run_that_is_stopped_is_off_and_comes_back_disarmed(tmp_path: Path) -> None:
    with guarded_run(tmp_path, guard=False) as run:
        run.signal(signal.SIGSTOP)
        status, said = safe_state(run)
        assert (status, run.is_off) == (0, True)
        assert f"process {run.run.pid} has not acknowledged" in said
        run.signal(signal.SIGCONT)
        wait_until(lambda: "safe-state took its right" in run.errors(), "the run knows it")
        assert_stays_off(run)


def test_a_run_of_another_version_is_asked_to_disarm(tmp_path: Path) -> None:
    with guarded_run(tmp_path, guard=False, program=OLDER) as run:
        assert safe_state(run) == (0, "")
        wait_until(lambda: "disarmed: requested" in run.errors(), "the run has disarmed")
        assert run.is_off


def test_several_at_once_and_the_guard_do_not_disturb_each_other(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run, ExitStack() as stack:
        words = ("safe-state", "tachobot", "--doubles", run.socket)
        several = [stack.enter_context(run.another(*words)) for _ in range(3)]
        assert [each.wait(PATIENCE_S) for each in several] == [0, 0, 0]
        assert_stays_off(run)


def test_what_something_else_drives_on_is_named(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        with run.another(str(run.socket), program=STRANGER) as stranger:
            as_fifo(stranger.pid, 98)  # it drives whatever else runs
            wait_until(lambda: run.outputs()["thrust_pairs.0"] == 0.5, "the stranger drives")
            status, said = safe_state(run)
        assert status == 4
        assert "PCA9685 at 0x40 on i2c1: outputs 0 are on" in said


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
