"""`service status` and `service logs`, with systemd's programs replaced by ones that only note."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.runs.restarts import Restarts
from tests.support.systemd_machine import ACTIVE, GUARD, RUN, SystemdMachine
from tests.support.written_run import WrittenRun

Command = Callable[..., Any]
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
    ended = subprocess.run(  # in a process of its own: journalctl takes its place
        [sys.executable, "-m", "firmware_runtime.cli", *words],
        env={"PATH": str(machine.programs.directory)},
        capture_output=True,
        text=True,
        check=False,
    )
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
