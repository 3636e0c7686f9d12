"""What may befall the things that a run and its guard rely on: none of it leaves an output on."""

import os
import signal
from pathlib import Path

import pytest

from tests.support.guarded_run import guarded_run, wait_until

pytestmark = pytest.mark.slow


def test_a_guard_whose_sentences_nobody_reads_goes_on(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        assert run.guard.stdout is not None
        run.guard.stdout.close()
        run.guard.stdout = None
        run.signal(signal.SIGSTOP)
        wait_until(lambda: run.is_off, "the guard has switched off")
        run.signal(signal.SIGCONT)
        wait_until(lambda: "the guard took over" in run.errors(), "the run has seen it")
        wait_until(lambda: run.ask("arm", "tachobot").returncode == 0, "it is guarded and armed")
        wait_until(lambda: not run.is_off, "the motors are driven again")
        run.signal(signal.SIGKILL)
        wait_until(lambda: run.is_off, "the guard has switched off again")


def test_a_run_whose_sentences_nobody_reads_goes_on(tmp_path: Path) -> None:
    program = (
        "import os, sys; from firmware_runtime.cli.main import main;"
        "gone = os.pipe(); os.close(gone[0]); os.dup2(gone[1], 2); sys.exit(main(sys.argv[1:]))"
    )
    with guarded_run(tmp_path, program=program) as run:
        assert run.ask("disarm", "tachobot").returncode == 0
        wait_until(lambda: run.is_off, "all outputs are off")
        wait_until(lambda: run.ask("arm", "tachobot").returncode == 0, "it can be armed anew")
        wait_until(lambda: not run.is_off, "the motors are driven again")
        assert run.run.poll() is None


def test_statistics_that_are_cut_short_end_the_run_and_not_the_guard(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        os.truncate(tmp_path / "tachobot.stats", 0)
        wait_until(lambda: bool(run.takeovers()), "the guard has taken over")
        assert run.run.wait(30) == -signal.SIGBUS
        assert run.is_off
        assert run.guard.poll() is None


def test_a_guard_that_is_stopped_before_outputs_are_off_says_so(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        assert run.guard.stdout is not None
        fault = ("doubles", "fault", "stuck", "--socket", run.socket, "--for", 20)
        assert run.ask(*fault).returncode == 0
        run.signal(signal.SIGKILL)
        assert "outputs not off" in run.guard.stdout.readline()
        run.guard.send_signal(signal.SIGTERM)
        assert run.guard.wait(30) == 4
        assert "not made safe: i2c1 0x40" in run.errors()


def test_a_guard_with_other_settings_does_not_let_the_run_be_armed(tmp_path: Path) -> None:
    """Which switches off other chips: as good as none."""
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        run.guard.kill()
        wait_until(lambda: run.is_off, "the run has disarmed itself")
        words = ("guard", "tachobot", "--doubles", run.socket, "--set", "esc.address=0x42")
        with run.another(*words) as other:
            assert other.stdout is not None
            assert "watching" in other.stdout.readline()
            assert "this run is not guarded" in other.stdout.readline()
            refused = run.ask("arm", "tachobot")
        assert refused.returncode == 5
        assert "the guard is absent" in refused.stderr


@pytest.mark.parametrize("options", [(), ("--supervised",)], ids=["free", "supervised"])
def test_a_run_on_doubles_of_its_own_takes_neither_guard_nor_control_from_a_robot(
    tmp_path: Path, options: tuple[str, ...]
) -> None:
    with guarded_run(tmp_path) as run:
        second = run.ask("run", "tachobot", "--doubles", "--for", "0.1", *options)
        assert (second.returncode, second.stdout) == (2, "")
        assert f"process {run.run.pid} drives a robot" in second.stderr
        assert not run.is_off
        assert run.ask("disarm", "tachobot").stdout == "disarmed\n"
        assert run.is_off


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda each: each.name)
def test_a_signal_ends_safe_state_between_attempts_and_it_says_what_is_still_on(
    tmp_path: Path, number: signal.Signals
) -> None:
    program = (
        "import os, signal, sys; from firmware_runtime.cli import safe_state;"
        "from firmware_runtime.cli.main import main; from boards.robot import Robot;"
        "whole = Robot.make_safe;"
        f"Robot.make_safe = lambda self: os.kill(os.getpid(), {number:d}) or whole(self);"
        "safe_state.PATIENCE = 10**12; sys.exit(main(sys.argv[1:]))"
    )
    with guarded_run(tmp_path, guard=False) as run:
        fault = ("doubles", "fault", "nack", "--socket", run.socket, "--address", "0x40")
        assert run.ask(*fault, "--for", 60).returncode == 0
        run.signal(signal.SIGKILL)
        words = ("safe-state", "tachobot", "--doubles", run.socket)
        with run.another(*words, program=program) as safe_state:
            assert safe_state.wait(30) == 4
        assert "not made safe: i2c1 0x40" in run.errors()
