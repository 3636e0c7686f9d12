"""What may befall the things that a run and its guard rely on: none of it leaves an output on."""

import os
import signal
from pathlib import Path

import pytest

from firmware_runtime.board import registry
from firmware_runtime.cli.commands import safe_state
from firmware_runtime.cli.main import main
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.runs.outputs import forget_settings, kept_settings
from tests.support.guarded_run import guarded_run, next_sentence
from tests.support.memory_limit import enter, killed_by_memory, memory_limit
from tests.support.trials import PATIENT
from tests.support.waiting import PATIENCE_S, wait_until

pytestmark = pytest.mark.slow


def test_a_guard_whose_output_is_not_read_goes_on(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        assert run.guard.stdout is not None
        run.guard.stdout.close()
        run.guard.stdout = None
        run.signal(signal.SIGSTOP)
        wait_until(lambda: run.is_off, "the guard has switched off")
        run.signal(signal.SIGCONT)
        wait_until(lambda: "the guard took over" in run.errors(), "the run has seen it")
        run.arm_again()
        run.signal(signal.SIGKILL)
        wait_until(lambda: run.is_off, "the guard has switched off again")


def test_an_orderly_end_is_no_takeover(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        run.signal(signal.SIGTERM)
        assert "the run has ended, with all outputs off" in next_sentence(run.guard)
        assert run.takeovers() == []
        assert run.is_off


def test_a_run_whose_output_is_not_read_goes_on(tmp_path: Path) -> None:
    program = (
        "import os, sys; from firmware_runtime.cli.main import main;"
        "gone = os.pipe(); os.close(gone[0]); os.dup2(gone[1], 2); sys.exit(main(sys.argv[1:]))"
    )
    with guarded_run(tmp_path, program=program) as run:
        assert run.ask("disarm", "tachobot").returncode == 0
        wait_until(lambda: run.is_off, "all outputs are off")
        run.arm_again()
        assert run.run.poll() is None


def test_statistics_that_are_cut_short_end_the_run_and_not_the_guard(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        os.truncate(tmp_path / "tachobot.stats", 0)
        wait_until(lambda: bool(run.takeovers()), "the guard has taken over")
        assert run.run.wait(PATIENCE_S) == -signal.SIGBUS
        assert run.is_off
        assert run.guard.poll() is None


def test_a_guard_that_is_stopped_before_outputs_are_off_says_so(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        fault = ("doubles", "fault", "stuck", "--socket", run.socket, "--for", 600)
        assert run.ask(*fault).returncode == 0
        run.signal(signal.SIGKILL)
        assert "outputs not off" in next_sentence(run.guard)
        run.guard.send_signal(signal.SIGTERM)
        assert run.guard.wait(PATIENCE_S) == 4
        assert "not made safe: i2c1 0x40" in run.errors()


def test_a_guard_with_other_settings_takes_up_those_of_the_run(tmp_path: Path) -> None:
    """Settings that it was started with may mean other chips."""
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        run.guard.kill()
        wait_until(lambda: run.is_off, "the run has disarmed itself")
        words = ("guard", "tachobot", "--doubles", run.socket, "--set", "thrust_pairs.address=0x42")
        with run.another(*words):
            run.arm_again()
            run.signal(signal.SIGKILL)
            wait_until(lambda: run.is_off, "the guard has switched off")


def test_a_guard_with_its_chips_on_another_bus_takes_up_the_run_s_even_if_one_is_stuck(
    tmp_path: Path,
) -> None:
    """The guard goes by the robot's own file, the run by one with a bus more."""
    begin, imu, rest = registry.load("tachobot").source.read_text("utf-8").partition("[imu] ")
    imu_s, pairs, own = rest.partition("[thrust_pairs]")
    another = '[buses.i2c2]\ndevice = "/dev/i2c-2"\nspeed_hz = 400_000\n\n'
    own = own.replace('bus = "i2c1"', 'bus = "i2c2"', 1)
    file = tmp_path / "two_buses.toml"
    file.write_text(f"{begin}{another}{imu}{imu_s}{pairs}{own}", encoding="utf-8")
    with guarded_run(tmp_path, board=str(file)) as run:
        fault = ("doubles", "fault", "stuck", "i2c1", "--for", 600)
        assert run.ask(*fault, "--socket", run.socket).returncode == 0
        run.signal(signal.SIGKILL)
        wait_until(lambda: run.is_off, "the guard has switched off", run.errors)


def test_a_guard_of_other_doubles_does_not_let_the_run_be_armed(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        assert run.guard is not None
        run.guard.kill()
        wait_until(lambda: run.is_off, "the run has disarmed itself")
        with run.another("guard", "tachobot", "--doubles", tmp_path / "others") as other:
            assert "watching" in next_sentence(other)
            assert "this run is not guarded" in next_sentence(other)
            refused = run.ask("arm", "tachobot")
        assert refused.returncode == 5
        assert "the guard is absent" in refused.stderr


@pytest.mark.parametrize(
    ("before", "after", "said", "status"),
    [
        ("address = 0x40", "address = 0x42", "not made safe: i2c1 0x42", 4),
        ("[imu]", "[imu", "its last run's settings were taken instead", 0),
    ],
)
def test_a_file_that_changed_under_the_run_does_not_keep_its_outputs_on(
    tmp_path: Path, before: str, after: str, said: str, status: int
) -> None:
    """Run and guard killed: safe-state alone is left, and its settings are others."""
    file = tmp_path / "tachobot.toml"
    shipped = registry.load("tachobot").source.read_text(encoding="utf-8")
    file.write_text(shipped, encoding="utf-8")
    with guarded_run(tmp_path, board=str(file), words=PATIENT) as run:
        assert run.guard is not None
        file.write_text(shipped.replace(before, after, 1), encoding="utf-8")
        run.guard.kill()
        run.signal(signal.SIGKILL)
        run.run.wait(PATIENCE_S)
        assert not run.is_off
        done = run.ask("safe-state", file, "--doubles", run.socket)
        assert run.is_off
        assert said in done.stderr
        assert done.returncode == status
        assert (tmp_path / "tachobot.settings").exists() == (status != 0)


def test_settings_are_kept_while_outputs_may_be_on(tmp_path: Path) -> None:
    with guarded_run(tmp_path) as run:
        assert (tmp_path / "tachobot.settings").exists()
        run.signal(signal.SIGTERM)
        run.run.wait(PATIENCE_S)
        assert not (tmp_path / "tachobot.settings").exists()


def test_without_a_place_for_statistics_it_still_switches_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def taken(_board: str) -> Path:
        raise StatisticsFileError("belongs to another user")

    monkeypatch.setattr(safe_state, "default_path", taken)
    with guarded_run(tmp_path, guard=False, words=PATIENT) as run:
        run.signal(signal.SIGKILL)
        run.run.wait(PATIENCE_S)
        assert not run.is_off
        assert main(["safe-state", "tachobot", "--doubles", str(run.socket)]) == 0
        wait_until(lambda: run.is_off, "all outputs are off")
    assert "all outputs off" in capsys.readouterr().out


def test_settings_that_may_not_be_removed_are_no_failure(tmp_path: Path) -> None:
    (tmp_path / "x.settings").mkdir()
    forget_settings(tmp_path / "x.stats")
    assert kept_settings(tmp_path / "x.stats") is None


def test_a_guard_whose_group_has_no_more_memory_switches_off(tmp_path: Path) -> None:
    """What it has stays with the group it came from; here is hardly a page for anything new.

    Each processor takes 256 KiB of a group's memory in advance.
    """
    in_advance = (os.cpu_count() or 1) * (256 << 10)
    with memory_limit((256 << 10) + in_advance) as group, guarded_run(tmp_path) as run:
        assert run.guard is not None
        enter(group, run.guard.pid)
        run.signal(signal.SIGKILL)
        wait_until(lambda: run.is_off, "the guard has switched off", run.errors)
        assert run.guard.poll() is None
        assert killed_by_memory(group) == 0


def test_sigterm_ends_a_run_whose_errors_are_a_full_pipe(tmp_path: Path) -> None:
    program = (
        "import os, sys; from firmware_runtime.cli.main import main;"
        "full = os.pipe(); os.dup2(full[1], 2); os.set_blocking(2, False);\n"
        "try:\n"
        "    while True: os.write(2, bytes(4096))\n"
        "except BlockingIOError: os.set_blocking(2, True)\n"
        "sys.exit(main(sys.argv[1:]))"
    )
    with guarded_run(tmp_path, program=program) as run:
        run.signal(signal.SIGTERM)
        assert run.run.wait(PATIENCE_S) == 128 + signal.SIGTERM
        assert run.is_off
