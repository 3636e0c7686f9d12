import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import pytest

import sim_doubles.rigs.tachobot
from firmware_runtime.board import installed as kinds
from firmware_runtime.cli import main

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
    command: Callable[..., Any], verb: tuple[str, ...], override: str, key: str, reason: str
) -> None:
    ended = command(*verb, "--set", override)
    assert ended.status == 2
    assert ended.out == ""
    assert key in ended.error
    assert reason in ended.error


@pytest.mark.parametrize(
    ("override", "key", "reason"),
    [
        ("esc.address=0x40", "esc.address", "thrust_pairs's already"),
        ("esc.frequency_hz=20", "esc.frequency_hz", "expected 24 to 1526 Hz"),
        ("esc.high_pulse_us=900", "esc.high_pulse_us", "more than low_pulse_us"),
    ],
)
def test_a_speed_controller_is_judged_where_there_is_one(
    command: Callable[..., Any], override: str, key: str, reason: str
) -> None:
    ended = command("check", "tachobot", "--set", "controller.mode=free", "--set", override)
    assert ended.status == 2
    assert f"{key}: " in ended.error
    assert reason in ended.error
    assert command("check", "tachobot", "--set", override).status == 0


def test_mode_free_demands_a_speed_controller_and_mode_platform_does_not(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    shipped = kinds.shipped_file("tachobot").read_text()
    before, _, rest = shipped.partition("[esc]")
    own = tmp_path / "board.toml"
    own.write_text(before + "[controller]" + rest.partition("[controller]")[2])
    assert command("check", own).status == 0
    ended = command("check", own, "--set", "controller.mode=free")
    assert ended.status == 2
    assert "esc: missing" in ended.error


def test_a_bus_that_cannot_carry_the_rate_is_refused(command: Callable[..., Any]) -> None:
    slow = ("--set", "buses.i2c1.speed_hz=100000", "--set", "controller.period_s=0.006")
    ended = command("check", "tachobot", *slow)
    assert ended.status == 2
    assert "i2c1: 90.8% of its time at 100000 Hz" in ended.error
    assert command(*VIRTUAL, *slow).status == 2


def test_a_bus_that_is_half_full_is_warned_of(command: Callable[..., Any]) -> None:
    ended = command("check", "tachobot", "--set", "buses.i2c1.speed_hz=100000")
    assert ended.status == 0
    assert "warning: i2c1: 54.5%" in ended.out


def test_all_faults_are_listed_at_once(command: Callable[..., Any]) -> None:
    bad = ("--set", "controller.yaw.kp=-1", "--set", "world.mass_kg=heavy", "--set", "imu.x=1")
    ended = command("check", "tachobot", *bad)
    assert "3 faults" in ended.error
    for key in ("controller.yaw.kp", "world.mass_kg", "imu.x"):
        assert key in ended.error


@pytest.mark.parametrize("verb", ["run", "check", "show"])
def test_an_unknown_board_is_refused_with_those_there_are(
    command: Callable[..., Any], verb: str
) -> None:
    ended = command(verb, "submarine")
    assert ended.status == 2
    assert "submarine: 1 fault" in ended.error
    assert "detective" in ended.error


@pytest.mark.parametrize("board", ["tachbot.toml", "./tachobot", "boards/none/board.toml"])
def test_a_file_that_is_not_there_is_no_unknown_board(
    command: Callable[..., Any], board: str
) -> None:
    ended = command("check", board)
    assert ended.status == 2
    assert "no such file" in ended.error
    assert "unknown board" not in ended.error


def test_a_folder_without_a_board_file_is_refused_as_such(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    ended = command("check", tmp_path)
    assert ended.status == 2
    assert "no board.toml in this folder" in ended.error


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (("chek", "tachobot"), "check"),
        (("check", "tachobt"), "tachobot"),
        (("check", "tachobot", "--set", "controler.yaw.kp=1"), "controller"),
        (("check", "tachobot", "--set", "controller.yaw.kpp=1"), "kp"),
        (("service", "statis"), "status"),
        (("service", "logs", "detectiv"), "detective"),
        (("run", "tachobot", "--doubles", "--clock", "virtul"), "virtual"),
        (("bench", "timng"), "timing"),
    ],
)
def test_what_was_probably_meant_is_said(
    command: Callable[..., Any], words: tuple[str, ...], meant: str
) -> None:
    ended = command(*words)
    assert ended.status == 2
    assert f" did you mean {meant}? Expected " in ended.error


def test_what_is_like_nothing_is_not_guessed_at(command: Callable[..., Any]) -> None:
    ended = command("check", "submarine")
    assert "did you mean" not in ended.error


def test_malformed_toml_is_refused_with_its_line(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    copy = tmp_path / "board.toml"
    original = kinds.shipped_file("tachobot").read_text()
    copy.write_text(original.replace("[controller.yaw]", "[controller.yaw"))
    ended = command("run", copy, "--doubles")
    assert ended.status == 2
    assert "not valid TOML" in ended.error
    assert "line" in ended.error


@pytest.mark.parametrize("text", [b"\xff\xfe", b'board = "t\xe4chobot"', bytes(range(128, 192))])
def test_a_board_file_that_is_no_text_is_refused_as_such(
    command: Callable[..., Any], tmp_path: Path, text: bytes
) -> None:
    (tmp_path / "board.toml").write_bytes(text)
    ended = command("check", tmp_path)
    assert ended.status == 2
    assert "not UTF-8" in ended.error


def test_a_board_file_may_begin_with_a_byte_order_mark(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    original = kinds.shipped_file("tachobot").read_bytes()
    (tmp_path / "board.toml").write_bytes(b"\xef\xbb\xbf" + original)
    assert command("check", tmp_path).status == 0


@pytest.mark.parametrize("path", [".", "", "folder"])
def test_statistics_are_not_kept_in_what_is_no_file(
    command: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    ended = command(*VIRTUAL, "--statistics", path)
    assert (ended.status, ended.out) == (2, "")
    assert "expected the path of a file" in ended.error


@pytest.mark.parametrize(
    ("clock", "named"),
    [(("--clock", "scaled"), "expected a speed"), (("--speed", "2"), "with clock scaled only")],
)
def test_a_speed_and_the_scaled_clock_belong_together(
    command: Callable[..., Any], clock: tuple[str, ...], named: str
) -> None:
    ended = command("run", "tachobot", "--doubles", *clock)
    assert ended.status == 2
    assert named in ended.error


def test_a_users_own_copy_of_a_board_file_is_taken(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    original = kinds.shipped_file("tachobot").read_text()
    (tmp_path / "board.toml").write_text(original)
    assert str(tmp_path) in command("check", tmp_path).out


@pytest.mark.parametrize(
    "options",
    [
        ("--clock", "virtual"),
        ("--doubles", "--clock", "scaled"),
        ("--doubles", "--speed", "3"),
        ("--doubles", "--clock", "scaled", "--speed", "0"),
        ("--doubles", "--clock", "scaled", "--speed", "1e308"),
        ("--doubles", "--for", "1e300"),
        ("--doubles", "--for", "-1"),
        ("--doubles", "--for", "nan"),
        ("--doubles", "--clock", "sundial"),
        ("--doubles", "--clock", "virtual", "--trace", "/nowhere/trace"),
        ("--doubles", "--statistics", "/proc/no/such"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    command: Callable[..., Any], options: tuple[str, ...]
) -> None:
    ended = command("run", "tachobot", *options)
    assert ended.status == 2
    assert ended.error != ""


def test_nothing_is_actuated_when_a_board_is_refused(
    command: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    built: list[object] = []
    monkeypatch.setattr(
        sim_doubles.rigs.tachobot.TachobotRig, "__init__", lambda *_: built.append(1)
    )
    assert command(*VIRTUAL, "--set", "imu.address=0x40").status == 2
    assert built == []


def test_an_absent_bus_is_named_with_what_was_expected(command: Callable[..., Any]) -> None:
    ended = command("run", "tachobot", "--set", "buses.i2c1.device=/dev/i2c-99")
    assert ended.status == 3
    assert "i2c1" in ended.error
    assert "/dev/i2c-99" in ended.error
    assert len(ended.error.splitlines()) == 1


def test_statistics_that_do_not_exist_are_reported(command: Callable[..., Any]) -> None:
    ended = command("stats", "tachobot")
    assert ended.status == 2
    assert "no statistics of tachobot" in ended.error


def test_a_file_that_is_no_statistics_file_is_refused(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("hello")
    ended = command("stats", "--statistics", path)
    assert ended.status == 2
    assert str(path) in ended.error


@pytest.mark.parametrize("ending", ["guard", "settings", "recording", "socket"])
def test_statistics_where_something_beside_them_would_stand_are_refused(
    command: Callable[..., Any], tmp_path: Path, ending: str
) -> None:
    ended = command(*VIRTUAL, "--statistics", tmp_path / f"x.{ending}")
    assert ended.status == 2
    assert f"x.{ending}: expected another ending" in ended.error


def test_results_that_cannot_be_kept_are_refused_before_anything_is_measured(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    ended = command("bench", "devstone", "--save", tmp_path / "file" / "results")
    assert ended.status == 2
    assert "file/results: Not a directory; expected a directory" in ended.error


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
    words = [sys.executable, "-c", program, "run", "tachobot", "--doubles"]
    environment = {**os.environ, "FIRMWARE_RUNTIME_STATE_DIRECTORY": str(tmp_path)}
    ended = subprocess.run(words, capture_output=True, text=True, env=environment, check=False)
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
    command: Callable[..., Any], words: tuple[str, ...]
) -> None:
    ended = command(*words)
    assert (ended.status, ended.out) == (2, "")
    assert "x" * 80 + "..." in ended.error
    assert len(ended.error) < 1000


def test_a_board_without_a_name_is_shown_as_one(command: Callable[..., Any]) -> None:
    ended = command("check", "")
    assert ended.status == 2
    assert ended.error.startswith("firmware-runtime: '': 1 fault")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("deploy", "host", "tachobot", "--port", "ssh"), "--port: 'ssh': expected a whole number"),
        (("gate", "a", "b", "c", "--seed", "x"), "--seed: 'x': expected a whole number"),
        (("run", "m:s", "--samples", "1.5"), "--samples: '1.5': expected a whole number"),
        (("experiment", "loop-delay", "tachobot", "--every", "x"), "'x': expected a positive"),
    ],
)
def test_a_number_that_is_none_is_said_with_what_was_expected(
    command: Callable[..., Any], words: tuple[str, ...], said: str
) -> None:
    ended = command(*words)
    assert ended.status == 2
    assert said in ended.error


def test_a_key_that_is_none_is_refused_before_a_stage_is_announced(
    command: Callable[..., Any], tmp_path: Path
) -> None:
    peer = ("--peer", "127.0.0.1:7302", "--key", tmp_path / "none")
    ended = command("run", "tachobot", "--stage", "remote", *peer)
    assert (ended.status, ended.out) == (2, "")
    assert "--key: " in ended.error
    assert "No such file" in ended.error
