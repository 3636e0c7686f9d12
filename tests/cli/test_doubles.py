"""`doubles`: served by one process, driven by another that may be killed; failing, and replayed."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.served import strikes
from firmware_runtime.hal.served.client import ServedBus, ServedDoubles
from firmware_runtime.hal.served.connection import Connection
from firmware_runtime.hal.served.strikes import ask_faults
from firmware_runtime.hal.strike import Strike
from firmware_runtime.hal.wire_errors import BusAbsent, BusFault, BusTimeout, NoAcknowledge
from firmware_runtime.recording.blackbox.reader import read_recording
from sim_doubles.recorded.traffic import traffic_of
from tests.support.command import Command, own_process, started
from tests.support.guarded_run import answer_like_chips
from tests.support.pytest_in_a_folder import run_pytest
from tests.support.recorded import record
from tests.support.second_choice_board import second_choice_board
from tests.support.served_rig import SERIAL_SONAR, ServedRig, served_rig
from tests.support.waiting import PATIENCE_S


@dataclass
class Served:
    """A server under way; `lines` waits for what it logs, with a bound."""

    board: str
    socket: Path
    lines: Iterator[dict[str, Any]]
    process: "subprocess.Popen[str]"

    def run(self, *arguments: str) -> "subprocess.Popen[str]":
        """Start a runtime against it."""
        return started(
            "run", self.board, "--doubles", self.socket, *arguments, stderr=subprocess.PIPE
        )

    def wait_for(self, is_it: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """Read the log on up to a line that fits."""
        for line in self.lines:
            if is_it(line):
                return line
        pytest.fail(f"nothing that fits was logged in {PATIENCE_S} s")


def turns(output: str) -> Callable[[dict[str, Any]], bool]:
    return lambda line: line.get("output") == output and line["value"] != 0


def stops(output: str) -> Callable[[dict[str, Any]], bool]:
    return lambda line: line.get("output") == output and line["value"] == 0


def is_gone(line: dict[str, Any]) -> bool:
    return line.get("event") == "gone"


@contextmanager
def serving(board: str, folder: Path) -> Iterator[Served]:
    socket, log = folder / "doubles.sock", folder / "doubles.log"
    process = started("doubles", "serve", board, "--socket", socket, "--log", log)
    assert process.stdout is not None
    assert process.stdout.readline().startswith("serving ")
    answer_like_chips(process.pid)
    follow = ["timeout", str(PATIENCE_S), "tail", "-n", "+1", "-f", str(log)]
    with subprocess.Popen(follow, stdout=subprocess.PIPE, text=True) as tail:
        try:
            yield Served(board, socket, map(json.loads, tail.stdout or ()), process)
        finally:
            tail.kill()
            process.terminate()
            process.communicate(timeout=PATIENCE_S)


@pytest.mark.slow
@pytest.mark.real_time
def test_a_robot_runs_on_served_doubles_as_on_its_own(tmp_path: Path) -> None:
    with serving("tachobot", tmp_path) as served:
        assert next(served.lines)["event"] == "serving"
        runtime = served.run("--for", "5", "--json")
        out, error = runtime.communicate(timeout=PATIENCE_S)
    document = json.loads(out)
    assert (runtime.returncode, error) == (0, "")
    assert document["result"]["yaw_rad"] == pytest.approx(1.0, abs=0.1)
    assert document["outputs_on"] == {"thrust_pairs": 0}


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("second_choice", [False, True], ids=["MD25", "Sabertooth"])
def test_a_motor_driver_stops_by_itself_when_the_runtime_is_killed(
    tmp_path: Path,
    second_choice: bool,  # noqa: FBT001 -- a parameter of the test
) -> None:
    """After a time that the tests of its double measure."""
    board = str(second_choice_board(tmp_path)) if second_choice else "detective"
    with serving(board, tmp_path) as served:
        runtime = served.run("--for", "60")
        served.wait_for(turns("treads.left"))
        runtime.kill()
        runtime.communicate(timeout=PATIENCE_S)
        gone_ns = served.wait_for(is_gone)["t_ns"]
        stopped_ns = served.wait_for(stops("treads.left"))["t_ns"]
    assert stopped_ns > gone_ns


@pytest.mark.slow
@pytest.mark.real_time
def test_a_socket_that_is_served_is_not_taken_over(tmp_path: Path) -> None:
    with serving("tachobot", tmp_path) as served:
        second = own_process("doubles", "serve", "tachobot", "--socket", served.socket)
    assert second.returncode == 2
    assert str(served.socket) in second.stderr


def test_doubles_that_are_not_served_are_refused(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("firmware_runtime.runs.hardware.SERVED_WITHIN_S", 0.05)
    path = tmp_path / "nosuch.sock"
    assert str(path) in command.refused("run", "tachobot", "--doubles", path, status=3)


def test_one_chip_fails_for_its_time_and_the_log_has_it(tmp_path: Path) -> None:
    log = tmp_path / "doubles.log"
    with served_rig("tachobot", log=log) as rig:
        bus = ServedDoubles(rig.ask, ["i2c1"], []).buses["i2c1"]
        ask_faults(rig.ask, Strike("nack", "i2c1@0x68", for_s=1.0))
        with pytest.raises(NoAcknowledge):
            bus.transaction(0x68, (b"\x75", 1))
        assert bus.transaction(0x40, (b"\xfe", 1)) == b"\x1e"
        rig.clock.advance(SECOND + 1)
        assert bus.transaction(0x68, (b"\x75", 1)) == b"\x71"
    faults = [json.loads(line) for line in log.read_text().splitlines() if "fault" in line]
    assert [(each["device"], each["until_ns"]) for each in faults] == [("i2c1@0x68", SECOND)]


def test_without_an_address_the_whole_bus_fails() -> None:
    with served_rig("detective") as rig:
        bus = ServedDoubles(rig.ask, ["i2c1"], []).buses["i2c1"]
        ask_faults(rig.ask, Strike("stuck", "i2c1", for_s=1.0))
        for address in (0x40, 0x58, 0x73):
            with pytest.raises(BusTimeout):
                bus.transaction(address, (b"\x00", 1))


def test_without_a_bus_all_fail_whatever_they_are_called(tmp_path: Path) -> None:
    log = tmp_path / "doubles.log"
    with served_rig("detective", log=log) as rig:
        bus = ServedDoubles(rig.ask, ["i2c1"], []).buses["i2c1"]
        ask_faults(rig.ask, Strike("stuck", for_s=1.0))
        with pytest.raises(BusTimeout):
            bus.transaction(0x40, (b"\x00", 1))
    (fault,) = [json.loads(line) for line in log.read_text().splitlines() if "fault" in line]
    assert (fault["kind"], fault["device"]) == ("stuck", "")


def test_a_bus_that_is_not_there_cannot_fail() -> None:
    with served_rig("tachobot") as rig, pytest.raises(ConfigError, match="i2c7"):
        ask_faults(rig.ask, Strike("stuck", "i2c7", for_s=1.0))


@pytest.mark.parametrize("span", ["0", "0.5", "1e9", "ever"])
def test_where_nothing_is_served_there_is_one_sentence_whatever_is_asked(
    command: Command, tmp_path: Path, span: str
) -> None:
    asked = ("doubles", "fault", "stuck", "--for", span, "--socket", str(tmp_path / "none"))
    assert "no doubles are served here" in command.refused(*asked, status=3)


class InHand:
    """In the place of a connection: what is asked goes to doubles in this process."""

    def __init__(self, rig: ServedRig) -> None:
        self.ask = rig.ask

    def close(self) -> None:
        """Leave them as they are."""


@pytest.fixture
def detective(monkeypatch: pytest.MonkeyPatch) -> Iterator[ServedRig]:
    """Its doubles, a second and a half after they were made, wherever they are asked for."""
    with served_rig("detective", *SERIAL_SONAR) as rig:
        monkeypatch.setattr(strikes, "Connection", lambda _path: InHand(rig))
        rig.clock.advance(3 * SECOND // 2)
        yield rig


FAULT = ("doubles", "fault", "--socket", "at hand")


@pytest.mark.usefixtures("detective")
def test_devices_and_lines_are_listed_with_where_they_are(command: Command) -> None:
    lines = [" ".join(line.split()) for line in command.said(*FAULT, "--list").splitlines()]
    assert lines[0] == "detective: kinds"
    begin = lines.index("devices and lines")
    assert {
        "radar_motor I2C PCA9685 at 0x40 on i2c1",
        "body_sonar serial MaxBotix on sonar",
        "i2c1 I2C all on it",
        "sonar serial all on it",
    } < set(lines[begin:])
    assert any(line.startswith("slow I2C") and "--amount 0.5, ms" in line for line in lines)
    assert not any("--amount" in line for line in lines if line.startswith("nack"))
    assert lines[-1] == "nothing was done yet"


@pytest.mark.usefixtures("detective")
@pytest.mark.parametrize(
    ("words", "made"),
    [
        ("nack radar_motor", "radar_motor: nack for 1 s"),
        ("nack radar_motor --for 2.5", "radar_motor: nack for 2.5 s"),
        ("nack --for 0", "all: nack once"),
        ("silent body_sonar --for ever", "body_sonar: silent until it is cleared"),
        ("brown-out treads", "treads: brown-out"),
        ("weak treads --amount 1", "treads: weak 1 for 1 s"),
        ("push --amount 0.5", "push 0.5"),
    ],
)
def test_what_was_broken_is_said_and_listed_with_its_instant(
    command: Command, words: str, made: str
) -> None:
    assert command.said(*FAULT, *words.split()) == f"{made}\n"
    *_, heading, last = command.said(*FAULT, "--list").splitlines()
    assert heading == "what was done"
    assert last.split(maxsplit=2) == ["1.500", "s", made]


def test_a_program_gets_all_that_is_listed(command: Command, detective: ServedRig) -> None:
    document = command.document(*FAULT, "nack", "radar_motor")
    assert (document["board"], document["at_ns"]) == ("detective", 3 * SECOND // 2)
    kinds = {each["kind"]: each for each in document["kinds"]}
    assert kinds["slow"]["amount"] == 0.5
    assert kinds["slow"]["unit"] == "ms"
    assert kinds["nack"]["unit"] is None
    devices = {each["name"]: each for each in document["devices"]}
    motor, line = devices["radar_motor"], devices["i2c1"]
    assert (motor["chip"], motor["line"], motor["address"]) == ("PCA9685", "i2c1", 0x40)
    assert (line["chip"], line["line"], line["address"]) == (None, "i2c1", None)
    (made,) = document["struck"]
    assert (made["at_ns"], made["span_ns"], made["amount"]) == (3 * SECOND // 2, SECOND, None)
    detective.clock.advance(SECOND // 2)
    (cleared,) = command.document(*FAULT, "clear")["struck"]
    assert cleared["span_ns"] == SECOND // 2
    assert command.said(*FAULT, "clear") == "detective: no fault any more\n"


@pytest.mark.slow
@pytest.mark.real_time
def test_served_chips_answer_and_fail_as_asked(command: Command, tmp_path: Path) -> None:
    socket = tmp_path / "doubles"
    words = ["doubles", "serve", "--chip", "pca9685@0x41", "--chip", "mpu9250"]
    with started(*words, "--socket", socket) as server:
        assert server.stdout is not None
        assert "serving chips" in server.stdout.readline()
        connection = Connection(socket, answer_s=PATIENCE_S)
        bus = ServedDoubles(connection.ask, ["i2c1"], []).buses["i2c1"]
        assert bus.write_read(0x41, b"\xfe", 1) == b"\x1e"
        faulty = ("doubles", "fault", "nack", "0x41", "--socket", socket)
        assert command(*faulty, "--for", 1000).status == 0
        with pytest.raises(NoAcknowledge):
            bus.write_read(0x41, b"\xfe", 1)
        assert bus.write_read(0x68, b"\x75", 1) == b"\x71"
        connection.close()
        server.terminate()
        assert server.wait(PATIENCE_S) == 0
    assert not socket.exists()


@pytest.mark.slow
@pytest.mark.real_time
def test_what_is_served_is_listed_broken_cleared_and_written_as_a_test(
    command: Command, tmp_path: Path
) -> None:
    with serving("pan_tilt", tmp_path) as served:
        broken = ("doubles", "fault", "--socket", served.socket)
        assert "ADS1115 at 0x48 on i2c1" in command.said(*broken, "--list")
        runtime = served.run("--for", "60")
        served.wait_for(turns("servos.0"))
        runtime.terminate()
        runtime.communicate(timeout=PATIENCE_S)
        assert command.said(*broken, "zero", "eyes", "--for", "ever") == (
            "eyes: zero until it is cleared\n"
        )
        fault = served.wait_for(lambda line: line.get("event") == "fault")
        assert (fault["kind"], fault["device"], fault["until_ns"]) == ("zero", "eyes", None)
        assert command.said(*broken, "push", "--amount", "0.2") == "push 0.2\n"
        assert "without a device" in command.refused(*broken, "push", "eyes")
        spanned = ("brown-out", "eyes", "--for", "2")
        assert "it is over at once" in command.refused(*broken, *spanned)
        (made, pushed) = command.document(*broken, "--list")["struck"]
        assert (made["kind"], made["span_ns"], pushed["amount"]) == ("zero", None, 0.2)
        path = tmp_path / "test_that_day.py"
        said = command.said(*broken, "--as-test", path)
        assert "2 faults in" in said
        assert "eyes: WrongDevice" in said.partition("noticed: ")[2]
        assert "is there already" in command.refused(*broken, "--as-test", path)
        assert "no fault any more" in command.said(*broken, "clear")
        assert strikes.clear(served.socket).struck[0].span is not None
    ended = run_pytest(tmp_path, "-p", "no:cacheprovider", path.name)
    assert ended.returncode == 0, ended.stdout


@pytest.mark.slow
@pytest.mark.real_time
def test_a_program_lists_and_breaks_served_doubles_by_their_path(tmp_path: Path) -> None:
    with serving("tachobot", tmp_path) as served:
        names = [place.name for place in strikes.faults_of(served.socket).places]
        assert names == ["imu", "thrust_pairs", "i2c1"]
        made = strikes.strike(served.socket, "push", amount=0.5).struck
        assert [each.kind for each in made] == ["push"]
        with pytest.raises(ConfigError, match="did you mean imu"):
            strikes.strike(served.socket, "freeze", "imv")
    with pytest.raises(BusAbsent):
        strikes.faults_of(served.socket)


@contextmanager
def replaying(folder: Path, *words: str) -> Iterator["subprocess.Popen[str]"]:
    """Serve a recording of a TachoBot at `folder`/doubles."""
    run, socket = str(folder / "run"), str(folder / "doubles")
    line = [sys.executable, "-m", "firmware_runtime.cli", "doubles", "replay", run, *words]
    with subprocess.Popen(
        [*line, "--socket", socket, "--log", str(folder / "log")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as server:
        try:
            assert server.stdout is not None
            assert server.stdout.readline().startswith("replaying tachobot-")
            yield server
        finally:
            server.kill()


def events(folder: Path, what: str) -> list[dict[str, Any]]:
    lines = [json.loads(each) for each in (folder / "log").read_text().splitlines()]
    return [each for each in lines if each["event"] == what]


@pytest.mark.slow
@pytest.mark.real_time
def test_it_ends_when_nobody_comes(tmp_path: Path) -> None:
    record(tmp_path / "run", "tachobot", 0.1)
    with replaying(tmp_path, "--wait", "0.2") as server:
        _, said = server.communicate(timeout=PATIENCE_S)
    assert server.returncode == 1
    assert "ended before transaction 1 of " in said
    assert not (tmp_path / "doubles").exists()


@pytest.mark.slow
@pytest.mark.real_time
def test_a_run_waits_for_doubles_that_are_served_a_moment_later(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("firmware_runtime.runs.hardware.SERVED_WITHIN_S", PATIENCE_S)
    socket = tmp_path / "doubles"
    serving = ("doubles", "serve", "tachobot", "--socket", socket)
    with started(*serving, stdout=subprocess.DEVNULL) as server:
        try:
            ended = command("run", "tachobot", "--doubles", socket, "--for", "0.1")
        finally:
            server.terminate()
    assert "no doubles are served" not in ended.error


@pytest.mark.slow
@pytest.mark.real_time
def test_it_ends_well_when_all_was_asked_for_and_the_last_has_gone(tmp_path: Path) -> None:
    recording = read_recording(record(tmp_path / "run", "tachobot", 0.1))
    with replaying(tmp_path) as server:
        connection = Connection(tmp_path / "doubles", answer_s=PATIENCE_S)
        bus = ServedBus("i2c1", connection.ask)
        for each in traffic_of(recording, [], 0).lines["i2c1"]:
            assert bus.transaction(each.transfer.address, each.transfer.messages) == (
                each.transfer.answer
            )
        connection.close()
        out, error = server.communicate(timeout=PATIENCE_S)
    assert server.returncode == 0
    assert (error, "all as recorded" in out) == ("", True)
    assert events(tmp_path, "stopped")[0]["deviations"] == 0
    assert not (tmp_path / "doubles").exists()


@pytest.mark.slow
@pytest.mark.real_time
def test_what_was_not_as_recorded_is_said_with_its_place_and_is_the_status(tmp_path: Path) -> None:
    record(tmp_path / "run", "tachobot", 0.1)
    with replaying(tmp_path) as server:
        connection = Connection(tmp_path / "doubles", answer_s=PATIENCE_S)
        with pytest.raises(BusFault, match="EPROTO"):
            ServedBus("i2c1", connection.ask).transaction(0x68, [b"\x00", 1])
        connection.close()
        server.terminate()
        _, error = server.communicate(timeout=PATIENCE_S)
    assert server.returncode == 1
    first, last = error.splitlines()
    assert first.startswith("transaction 1, i2c1 0x40, at ")
    assert first.endswith("recorded W 0104, asked i2c1 0x68 W 00, R 1; refused")
    assert last.startswith("ended before transaction 1 of ")
    (deviation,) = events(tmp_path, "deviation")
    assert (deviation["number"], deviation["device"]) == (1, "i2c1 0x68")


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("board", ["tachobot", "pan_tilt"])
def test_the_same_robot_on_a_socket_in_real_time_finds_its_chips_and_ends_safe(
    tmp_path: Path, board: str
) -> None:
    recording = read_recording(record(tmp_path / "run", board, 0.3))
    run = [sys.executable, "-m", "firmware_runtime.cli", "run", board, "--for", "0.3"]
    line = [sys.executable, "-m", "firmware_runtime.cli", "doubles", "replay"]
    line += [str(tmp_path / "run"), "--warn", "--socket", str(tmp_path / "doubles")]
    line += ["--log", str(tmp_path / "log")]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as server:
        try:
            assert server.stdout is not None
            server.stdout.readline()
            words = ["--doubles", str(tmp_path / "doubles")]
            ended = subprocess.run(
                [*run, *words, "--statistics", str(tmp_path / "run.stats")],
                capture_output=True,
                text=True,
                timeout=PATIENCE_S,
                check=False,
            )
        finally:
            server.terminate()
            server.wait(PATIENCE_S)
    assert "not made safe" not in ended.stderr
    assert ended.returncode in {0, 1}, ended.stderr  # 1: a machine too busy for the robot
    probed = next(s for s in recording.segments()[0].sections() if s.kind.name == "PROBE")
    numbers = [each["number"] for each in events(tmp_path, "deviation")]
    assert all(each is None or each > len(probed.transfers) for each in numbers)
