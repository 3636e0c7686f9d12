"""A service: its status, its logs, and how it is started again and again."""

import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.runs import restarts
from firmware_runtime.runs.restarts import FIRST_PAUSE, Restarts, counted, read_starts
from firmware_runtime.system.messages import Notices
from tests.support.command import Command, own_process
from tests.support.systemd_machine import ACTIVE, GUARD, RUN, SystemdMachine
from tests.support.waiting import PATIENCE_S
from tests.support.written_run import WrittenRun

FAILED = """ActiveState=failed
SubState=failed
MainPID=0
NRestarts=4
Result=watchdog
"""


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> SystemdMachine:
    return SystemdMachine(tmp_path, monkeypatch)


def install(command: Command, machine: SystemdMachine, *boards: str) -> None:
    for board in boards:
        assert command("service", "install", board, "--root", machine.root).status == 0


def test_status_is_a_table_with_what_the_units_say(
    command: Command, machine: SystemdMachine
) -> None:
    ended = command("service", "status", "tachobot")
    assert ended.status == 0
    runtime = next(line for line in ended.out.splitlines() if "runtime" in line)
    since = ["Sat", "2026-11-21", "07:15:18", "UTC"]
    assert runtime.split() == ["runtime", "active", "(running)", *since, "4711", "2", "2s"]
    assert ended.out.count("100 Hz 99.98 % on time, late 3") == 2
    assert "statistics  no statistics of tachobot in" in ended.out
    assert [call.split()[1:3] for call in machine.calls] == [["show", RUN], ["show", GUARD]]


@pytest.mark.usefixtures("machine")
def test_status_ends_with_the_line_of_the_statistics(
    command: Command, state_directory: Path
) -> None:
    state_directory.mkdir()
    run = WrittenRun(path=state_directory / "tachobot.stats")
    run.activation(0, 1000, 2000)
    ended = command("service", "status", "tachobot")
    line = ended.out.splitlines()[-1]
    assert line.startswith("  statistics  100 Hz 100.00 % on time, late 0 skip 0/1 ")
    reported = json.loads(command("service", "status", "tachobot", "--json").out)
    assert reported["boards"]["tachobot"]["statistics"] == line.removeprefix("  statistics  ")


@pytest.mark.parametrize("printed", [FAILED, "", ACTIVE.replace("=active", "=activating")])
def test_what_is_not_active_is_in_the_exit_status(
    command: Command, machine: SystemdMachine, printed: str
) -> None:
    machine.programs.add("systemctl", out=printed)
    assert command("service", "status", "tachobot").status == 6


@pytest.mark.usefixtures("machine")
def test_starts_that_failed_in_a_row_are_reported(command: Command, state_directory: Path) -> None:
    def failed_starts() -> int:
        reported = json.loads(command("service", "status", "tachobot", "--json").out)
        return int(reported["boards"]["tachobot"]["failed_starts"])

    assert failed_starts() == 0
    for _ in range(5):
        Restarts(state_directory / "tachobot.stats").begin()
    assert failed_starts() == 4
    shown = command("service", "status", "tachobot").out
    assert "starts      4 failed in a row before this one, which waited 4 s" in shown


def test_how_a_service_ended_is_reported(command: Command, machine: SystemdMachine) -> None:
    machine.programs.add("systemctl", out=FAILED)
    lines = command("service", "status", "tachobot").out.splitlines()
    assert lines[1].split() == ["runtime", "failed", "(failed)", "-", "-", "4", "-"]
    assert lines[2].strip() == "ended with watchdog"


def test_without_a_board_all_that_are_installed_are_shown(
    command: Command, machine: SystemdMachine
) -> None:
    install(command, machine, "tachobot", "detective")
    reported = json.loads(command("service", "status", "--json").out)
    assert (reported["schema"], list(reported["boards"])) == (1, ["detective", "tachobot"])
    run = reported["boards"]["tachobot"]["runtime"]
    assert (run["unit"], run["active"], run["pid"], run["restarts"]) == (RUN, "active", 4711, 2)
    assert reported["boards"]["tachobot"]["statistics"] is None


@pytest.mark.usefixtures("machine")
def test_where_no_board_is_installed_that_is_said(command: Command) -> None:
    ended = command("service", "status")
    assert (ended.status, ended.out) == (6, "")
    assert "no board is installed; expected `firmware-runtime service install" in ended.error


@pytest.mark.slow
def test_logs_are_those_of_run_and_guard(machine: SystemdMachine) -> None:
    machine.programs.add("journalctl", out="an entry\n")
    words = ("service", "logs", "tachobot", "--since", "1 h ago", "--follow")
    ended = own_process(*words, env={"PATH": str(machine.programs.directory)})
    assert (ended.returncode, ended.stdout) == (0, "an entry\n")
    assert machine.calls == [f"journalctl --unit={RUN} --unit={GUARD} --since=1 h ago --follow"]


def entry(**fields: object) -> str:
    return json.dumps({"__REALTIME_TIMESTAMP": "1763709318123456", "MESSAGE": "m", **fields}) + "\n"


def test_episodes_are_a_table_of_their_fields(command: Command, machine: SystemdMachine) -> None:
    late = {"PERIOD_US": "10000", "LATE_US": "12345", "MISSED": "1", "CAUSE": "waking"}
    entries = entry() + entry(MODEL="tachobot.imu", **late) + entry()
    machine.programs.add("journalctl", out=entries)
    ended = command("service", "logs", "tachobot", "--episodes")
    heading, *rows = ended.out.splitlines()
    assert (ended.status, len(rows)) == (0, 1)
    assert heading.split() == ["when", "model", *late]
    assert rows[0].split()[2:] == ["tachobot.imu", *late.values()]
    assert rows[0].partition(".")[2].startswith("123456  ")
    assert "--output=json --quiet --output-fields=MODEL,PERIOD_US" in machine.calls[0]


@pytest.mark.parametrize("words", [[], ["--episodes"]])
def test_a_machine_without_a_journal_is_reported(
    command: Command, machine: SystemdMachine, words: list[str]
) -> None:
    ended = command("service", "logs", "tachobot", *words)
    assert (ended.status, machine.calls) == (6, [])
    assert "journalctl: not found; expected a system that systemd runs" in ended.error


def test_a_journal_that_refuses_is_no_success(command: Command, machine: SystemdMachine) -> None:
    machine.programs.add("journalctl", status=1)
    ended = command("service", "logs", "tachobot", "--episodes", "--since", "then")
    assert (ended.status, "journalctl: ended with status 1" in ended.error) == (6, True)


PROGRAM = (sys.executable, "-m", "firmware_runtime.cli")
COMMAND = (*PROGRAM, "run", "tachobot", "--doubles")


class Manager:
    """Stands for systemd: takes notices, starts the run."""

    def __init__(self, folder: Path) -> None:
        self.statistics = folder / "tachobot.stats"
        self._notify = folder / "notify"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(self._notify))
        self._socket.settimeout(PATIENCE_S)

    def start(self, *words: str, command: Sequence[str] = COMMAND) -> "subprocess.Popen[bytes]":
        return subprocess.Popen(
            [*command, "--statistics", str(self.statistics), *words],
            env={**os.environ, "NOTIFY_SOCKET": str(self._notify)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def notices(self, monkeypatch: pytest.MonkeyPatch) -> Notices:
        """Those of a run in this process."""
        monkeypatch.setenv("NOTIFY_SOCKET", str(self._notify))
        return Notices()

    def wait_for(self, what: str) -> str:
        """The next notice with this in it."""
        while what not in (notice := self._socket.recv(4096).decode()):
            pass
        return notice

    @property
    def failed(self) -> int | None:
        starts = read_starts(self.statistics)
        return None if starts is None else starts.failed

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[Manager]:
    made = Manager(tmp_path)
    yield made
    made.close()


@pytest.mark.parametrize(
    ("status", "failed"),
    [(Status.OK, None), (Status.TERMINATED, None), (Status.MODEL_ERROR, 1), (Status.NOT_SAFE, 1)],
)
def test_only_an_end_that_was_no_failure_is_forgotten(
    manager: Manager, monkeypatch: pytest.MonkeyPatch, status: Status, failed: int | None
) -> None:
    def refuse(_restarts: Restarts | None) -> int:
        raise ConfigError("run", ["no such key"])

    notices = manager.notices(monkeypatch)
    Restarts(manager.statistics).begin()
    with pytest.raises(ConfigError):
        counted(refuse, manager.statistics, notices, 0)
    assert manager.failed is None
    Restarts(manager.statistics).begin()
    assert counted(lambda _: status, manager.statistics, notices, 0) == status
    assert manager.failed == failed
    notices.close()


@pytest.mark.parametrize("is_managed", [False, True])
def test_a_start_without_a_manager_or_without_statistics_is_not_counted(
    manager: Manager, monkeypatch: pytest.MonkeyPatch, *, is_managed: bool
) -> None:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    notices = manager.notices(monkeypatch) if is_managed else Notices()
    place = None if is_managed else manager.statistics
    given: list[Restarts | None] = []

    def fail(restarts: Restarts | None) -> int:
        given.append(restarts)
        return Status.MODEL_ERROR

    assert counted(fail, place, notices, 0) == Status.MODEL_ERROR
    assert (given, manager.failed) == ([None], None)
    notices.close()


def test_a_manager_learns_of_a_wait_before_it_and_gives_it_the_time(
    manager: Manager, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(restarts, "pause_after", lambda _failed: FIRST_PAUSE + MILLISECOND)
    notices = manager.notices(monkeypatch)
    for _ in range(2):
        Restarts(manager.statistics).begin()
    assert counted(lambda _: Status.OK, manager.statistics, notices, SECOND) == Status.OK
    said = manager.wait_for("EXTEND_TIMEOUT_USEC")
    assert "the last 2 starts failed: waits 0.001 s, outputs are off" in said
    assert "EXTEND_TIMEOUT_USEC=1001000" in said
    notices.close()


@pytest.mark.slow
def test_a_run_that_dies_again_and_again_is_counted_until_it_ends_well(manager: Manager) -> None:
    for failed in range(2):
        run = manager.start("--for", "1000")
        manager.wait_for("READY=1")
        assert manager.failed == failed
        run.kill()
        run.wait(PATIENCE_S)
    run = manager.start("--for", "1000")
    said = manager.wait_for("EXTEND_TIMEOUT_USEC")
    assert "the last 2 starts failed: waits 0.5 s, outputs are off" in said
    manager.wait_for("READY=1")
    run.send_signal(signal.SIGTERM)
    assert run.wait(PATIENCE_S) == 143
    assert manager.failed is None


@pytest.mark.slow
def test_a_wait_is_ended_by_a_stop_and_nothing_was_opened(manager: Manager) -> None:
    for _ in range(12):
        Restarts(manager.statistics).begin()
    run = manager.start()
    said = manager.wait_for("EXTEND_TIMEOUT_USEC")
    assert "waits 29.5 s" in said
    assert f"EXTEND_TIMEOUT_USEC={89_500_000}" in said
    run.send_signal(signal.SIGTERM)
    assert run.wait(PATIENCE_S) == 143
    assert not manager.statistics.exists()
    assert manager.failed is None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("override", "status", "failed"),
    [("controller.yaw.kp=much", 2, None), ("overruns.nothing={}", 2, None)],
)
def test_settings_that_no_start_fixes_do_not_count(
    manager: Manager, override: str, status: int, failed: int | None
) -> None:
    assert manager.start("--set", override).wait(PATIENCE_S) == status
    assert manager.failed == failed


@pytest.mark.slow
def test_a_run_that_no_manager_starts_is_not_counted(tmp_path: Path) -> None:
    statistics = tmp_path / "tachobot.stats"
    words = ("--clock", "virtual", "--for", "1", "--json", "--statistics", str(statistics))
    done = subprocess.run([*COMMAND, *words], capture_output=True, timeout=PATIENCE_S, check=True)
    assert json.loads(done.stdout)["ended"]["state"] == "ended"
    assert read_starts(statistics) is None


@pytest.mark.slow
def test_a_guard_that_dies_again_and_again_leaves_the_processor_to_others(manager: Manager) -> None:
    guard = (*PROGRAM, "guard", "tachobot")
    for _ in range(2):
        watching = manager.start(command=guard)
        manager.wait_for("READY=1")
        watching.kill()
        watching.wait(PATIENCE_S)
    assert manager.failed is None
    watching = manager.start(command=guard)
    said = manager.wait_for("EXTEND_TIMEOUT_USEC")
    assert "the last 2 starts failed: waits 0.5 s, nothing is watched" in said
    manager.wait_for("READY=1")
    watching.send_signal(signal.SIGTERM)
    assert watching.wait(PATIENCE_S) == 0
    assert read_starts(manager.statistics.with_stem("tachobot-guard")) is None
