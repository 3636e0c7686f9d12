"""Input, options and machines that are of no use: one sentence and a status, never a traceback."""

import errno
import os
import resource
import socket
import subprocess
from pathlib import Path
from typing import NoReturn

import pytest

import sim_doubles.rigs.tachobot
from firmware_runtime.board import installed as kinds
from firmware_runtime.cli import main
from firmware_runtime.cli import main as module
from firmware_runtime.errors import Status
from tests.support.command import COMMAND, Command, in_python
from tests.support.waiting import PATIENCE_S

VIRTUAL = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", "1")
LONG = "x" * 5000


@pytest.mark.parametrize(
    ("override", "key", "reason"),
    [
        ("controller.yaw.kpp=1", "controller.yaw.kpp", "unknown key"),
        ("controller.yaw.reference_rad=nan", "controller.yaw.reference_rad", "not a finite number"),
        ("imu.address=0x40", "thrust_pairs.address", "imu's already"),
        ("imu.address=0x70", "imu.address", "every PCA9685 answers"),
        ("thrust_pairs.frequency_hz=1600", "thrust_pairs.frequency_hz", "expected 24 to 1526 Hz"),
        ("esc.throttel=0.5", "esc.throttel", "unknown key"),
        ("imu.bus=i2c7", "imu.bus", "expected one of i2c1"),
        ("imu.sample_hz=100", "imu.sample_hz", "more than the control rate"),
        ("imu.gyro_range_dps=300", "imu.gyro_range_dps", "expected one of 250"),
        ("thrust_pairs.timeout_s=1e300", "thrust_pairs.timeout_s", "<= 1000000000.0"),
        ("controller.yaw.delay_s=1e300", "controller.yaw.delay_s", "<= 10.0"),
        ("esc.arming_s=1e300", "esc.arming_s", "<= 1000000000.0"),
        ("output_enable.lien=17", "output_enable.lien", "unknown key"),
        ("buses.i2c1.device=", "buses.i2c1.device", "expected str"),
        ('buses.i2c1.device="a\\u0000b"', "buses.i2c1.device", "expected str"),
        ("buses.i2c1.speed_hz=0.001", "buses.i2c1.speed_hz", ">= 1.0"),
        ("thrust_pairs.timeout_s=0.01", "thrust_pairs.timeout_s", "two control periods"),
        ("world.coulomb_friction_nm=1", "world.static_friction_nm", "expected at least"),
        ("board=submarine", "board", "detective"),
        ("=1", "--set", "expected KEY=VALUE"),
        ("executive.overload=explode", "executive.overload", "expected one of yield, stop"),
        ("imu=3", "imu", "expected a table"),
        ("executive.cpus=3", "executive.cpus", "expected a list"),
    ],
)
@pytest.mark.parametrize("verb", [VIRTUAL, ("check", "tachobot")])
def test_a_bad_setting_is_refused_with_its_key_and_reason(
    command: Command, verb: tuple[str, ...], override: str, key: str, reason: str
) -> None:
    error = command.refused(*verb, "--set", override)
    assert key in error
    assert reason in error


@pytest.mark.parametrize(
    ("override", "key", "reason"),
    [
        ("esc.address=0x40", "esc.address", "thrust_pairs's already"),
        ("esc.frequency_hz=20", "esc.frequency_hz", "expected 24 to 1526 Hz"),
        ("esc.high_pulse_us=900", "esc.high_pulse_us", "more than low_pulse_us"),
    ],
)
def test_a_speed_controller_is_judged_where_there_is_one(
    command: Command, override: str, key: str, reason: str
) -> None:
    error = command.refused("check", "tachobot", "--set", "controller.mode=free", "--set", override)
    assert f"{key}: " in error
    assert reason in error
    assert command("check", "tachobot", "--set", override).status == 0


def test_mode_free_demands_a_speed_controller_and_mode_platform_does_not(
    command: Command, tmp_path: Path
) -> None:
    shipped = kinds.shipped_file("tachobot").read_text()
    before, _, rest = shipped.partition("[esc]")
    own = tmp_path / "board.toml"
    own.write_text(before + "[controller]" + rest.partition("[controller]")[2])
    assert command("check", own).status == 0
    assert "esc: missing" in command.refused("check", own, "--set", "controller.mode=free")


def test_a_bus_that_cannot_carry_the_rate_is_refused(command: Command) -> None:
    slow = ("--set", "buses.i2c1.speed_hz=100000", "--set", "controller.period_s=0.006")
    assert "i2c1: 90.8% of its time at 100000 Hz" in command.refused("check", "tachobot", *slow)
    assert command(*VIRTUAL, *slow).status == 2


def test_a_bus_that_is_half_full_is_warned_of(command: Command) -> None:
    ended = command("check", "tachobot", "--set", "buses.i2c1.speed_hz=100000")
    assert ended.status == 0
    assert "warning: i2c1: 54.5%" in ended.out


def test_all_faults_are_listed_at_once(command: Command) -> None:
    bad = ("--set", "controller.yaw.kp=-1", "--set", "world.mass_kg=heavy", "--set", "imu.x=1")
    ended = command("check", "tachobot", *bad)
    assert "3 faults" in ended.error
    for key in ("controller.yaw.kp", "world.mass_kg", "imu.x"):
        assert key in ended.error


def test_malformed_toml_is_refused_with_its_line(command: Command, tmp_path: Path) -> None:
    copy = tmp_path / "board.toml"
    original = kinds.shipped_file("tachobot").read_text()
    copy.write_text(original.replace("[controller.yaw]", "[controller.yaw"))
    error = command.refused("run", copy, "--doubles")
    assert "not valid TOML" in error
    assert "line" in error


@pytest.mark.parametrize("text", [b"\xff\xfe", b'board = "t\xe4chobot"', bytes(range(128, 192))])
def test_a_board_file_that_is_no_text_is_refused_as_such(
    command: Command, tmp_path: Path, text: bytes
) -> None:
    (tmp_path / "board.toml").write_bytes(text)
    assert "not UTF-8" in command.refused("check", tmp_path)


def test_a_board_file_may_begin_with_a_byte_order_mark(command: Command, tmp_path: Path) -> None:
    original = kinds.shipped_file("tachobot").read_bytes()
    (tmp_path / "board.toml").write_bytes(b"\xef\xbb\xbf" + original)
    assert command("check", tmp_path).status == 0


def test_a_users_own_copy_of_a_board_file_is_taken(command: Command, tmp_path: Path) -> None:
    original = kinds.shipped_file("tachobot").read_text()
    (tmp_path / "board.toml").write_text(original)
    assert str(tmp_path) in command("check", tmp_path).out


def test_nothing_is_actuated_when_a_board_is_refused(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    built: list[object] = []
    monkeypatch.setattr(
        sim_doubles.rigs.tachobot.TachobotRig, "__init__", lambda *_: built.append(1)
    )
    assert command(*VIRTUAL, "--set", "imu.address=0x40").status == 2
    assert built == []


def test_an_absent_bus_is_named_with_what_was_expected(command: Command) -> None:
    error = command.refused("run", "tachobot", "--set", "buses.i2c1.device=/dev/i2c-99", status=3)
    assert "i2c1" in error
    assert "/dev/i2c-99" in error
    assert len(error.splitlines()) == 1


def test_ctrl_c_while_a_verb_is_imported_is_no_traceback(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def interrupted(_module: str) -> NoReturn:
        raise KeyboardInterrupt

    monkeypatch.setattr(main, "import_module", interrupted)
    assert main.main(["run", "tachobot"]) == 130
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_ctrl_c_while_a_run_begins_is_no_traceback(tmp_path: Path) -> None:
    program = (
        "import sys; from firmware_runtime.cli import main\n"
        "from firmware_runtime.cli.commands import run\n"
        "def interrupted(*_, **__): raise KeyboardInterrupt\n"
        "run.start_session = interrupted; sys.exit(main.main(sys.argv[1:]))"
    )
    environment = {**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(tmp_path)}
    ended = in_python(program, "run", "tachobot", "--doubles", env=environment)
    assert (ended.returncode, ended.stderr) == (130, "")


@pytest.mark.parametrize(
    "words",
    [
        ("stats", LONG),
        ("deploy", "robot", "tachobot", "--settings", LONG, "--dry-run"),
        ("run", "detective", "--doubles", "--clock", "virtual", "--plot", f"{LONG}.svg"),
    ],
    ids=lambda words: words[0],
)
def test_a_name_that_no_file_can_have_is_bad_input(
    command: Command, words: tuple[str, ...]
) -> None:
    error = command.refused(*words)
    assert "x" * 80 + "..." in error
    assert len(error) < 1000


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (OSError(errno.EMFILE, "", "/dev/null"), "/dev/null: Too many open files; expected a "),
        (OSError(errno.ENOSPC, "", "/srv/x"), "/srv/x: No space left on device; expected room"),
        (MemoryError(), "Cannot allocate memory; expected more"),
        (
            FileNotFoundError(errno.ENOENT, "No usable temporary directory found in ['/tmp']"),
            "No usable temporary directory found in ['/tmp']; expected one with room",
        ),
    ],
)
def test_what_is_scarce_is_said(
    error: Exception,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(_: object) -> int:
        raise error

    monkeypatch.setattr(module, "_executed", fail)
    assert module.main(["show"]) == Status.MODEL_ERROR
    printed = capsys.readouterr().err
    assert said in printed
    assert len(printed.splitlines()) == 1


@pytest.mark.parametrize("number", [errno.EBADF, errno.ENOENT])
def test_any_other_error_is_not_hidden(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: object) -> int:
        raise OSError(number, "a defect")

    monkeypatch.setattr(module, "_executed", fail)
    with pytest.raises(OSError, match="a defect"):
        module.main(["show"])


@pytest.mark.real_time
@pytest.mark.parametrize("limit", [10, 12])
def test_two_ends_without_descriptors_are_one_sentence(limit: int, tmp_path: Path) -> None:
    ended = subprocess.run(
        [*COMMAND, "run", "tachobot", "--stage", "network", "--for", "0.5"],
        env=os.environ | {"FIRMWARE_RUNTIME_STATE_DIRECTORY": str(tmp_path)},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (limit, limit)),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert ended.returncode == Status.MODEL_ERROR
    assert "Traceback" not in ended.stderr
    assert "Too many open files" in ended.stderr


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EDQUOT])
@pytest.mark.parametrize("call", ["os.posix_fallocate", "socket.socket.bind"])
def test_a_state_directory_without_room_is_no_bad_input(
    number: int,
    call: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(*_: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))
    owner = os if call.startswith("os.") else FailingSocket
    monkeypatch.setattr(owner, call.rpartition(".")[2], fail)
    monkeypatch.setattr("socket.socket", FailingSocket)
    ended = module.main(["run", "tachobot", "--doubles", "--for", "0.1"])
    assert ended == Status.MODEL_ERROR  # which a service tries again, unlike bad input
    said = capsys.readouterr().err
    assert os.strerror(number) in said
    assert "expected a disk with room that is writable" in said


class FailingSocket(socket.socket):
    """One whose methods can be replaced."""
