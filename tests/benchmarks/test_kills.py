"""The bench kills, says when outputs were off by the doubles' record, and leaves nothing behind."""

import json
import os
import signal
import subprocess
from contextlib import ExitStack
from pathlib import Path
from unittest.mock import Mock

import pytest

from benchmarks.kills.killed import Killed, kill_now
from benchmarks.kills.kills import Kills
from benchmarks.kills.record import FLICKER, OutputRecord
from benchmarks.kills.rounds import Rounds
from benchmarks.kills.standstill import Standstills
from firmware_runtime.cli.main import main
from firmware_runtime.devs.time import MILLISECOND

SERVED_AT = 7_000_000_000


def record(path: Path, *lines: tuple[int, str, float]) -> OutputRecord:
    """A log of outputs at ms since the server's start."""
    words = [{"t_ns": 0, "event": "serving", "monotonic_ns": SERVED_AT}]
    words += [
        {"t_ns": at * MILLISECOND, "output": output, "value": value} for at, output, value in lines
    ]
    path.write_text("".join(f"{json.dumps(each)}\n" for each in words))
    return OutputRecord(path)


def test_outputs_are_off_when_the_last_of_them_is_and_stays_so(tmp_path: Path) -> None:
    found = record(
        tmp_path / "log",
        *((10, "a", 0.5), (10, "b", 0.5)),
        *((500, "a", 0.0), (503, "b", 0.0)),
        (1200, "a", 0.5),
    )
    at = SERVED_AT + 20 * MILLISECOND
    off_at = found.off_since(at, lambda: SERVED_AT + 2000 * MILLISECOND)
    assert off_at == SERVED_AT + 503 * MILLISECOND
    assert found.on_after(off_at) == SERVED_AT + 1200 * MILLISECOND
    assert found.is_on


def test_a_command_of_nothing_is_no_output_that_went_off(tmp_path: Path) -> None:
    found = record(tmp_path / "log", (10, "a", 0.5), (100, "a", 0.0), (110, "a", 0.5))
    at = SERVED_AT + 20 * MILLISECOND
    assert found.off_since(at, lambda: SERVED_AT + 9000 * MILLISECOND) is None


def test_outputs_that_have_just_gone_off_may_come_on_again(tmp_path: Path) -> None:
    found = record(tmp_path / "log", (10, "a", 0.5), (100, "a", 0.0))
    off_at = SERVED_AT + 100 * MILLISECOND
    assert found.off_since(off_at - 1, lambda: off_at + FLICKER - 1) is None
    assert found.off_since(off_at - 1, lambda: off_at + FLICKER) == off_at


def test_kills_count_those_in_time_and_those_that_stayed_off() -> None:
    kills = Kills()
    kills.note(Killed(0, 0), 500 * MILLISECOND, None)
    kills.note(Killed(0, MILLISECOND), 520 * MILLISECOND, 900 * MILLISECOND)
    found = kills.report()
    assert (found["kills"], found["within"], found["stayed_off"]) == (2, 1, 1)
    assert (found["median_ms"], found["worst_ms"], found["known_to_ms"]) == (510.0, 520.0, 1.0)


def test_what_is_beyond_the_goal_is_said_with_what_the_machine_did_meanwhile() -> None:
    kills = Kills()
    kills.note(Killed(0, 0), 500 * MILLISECOND, None, lambda _begin, _end: 7.0)
    kills.note(Killed(0, 0), 520 * MILLISECOND, None, lambda begin, end: (end - begin) / 1e8)
    assert kills.report()["beyond"] == [{"took_ms": 520.0, "stood_still_ms": 5.2}]


def test_a_process_that_is_killed_is_so_between_two_instants() -> None:
    process = subprocess.Popen(["sleep", "60"])
    killed = kill_now(process.pid)
    assert process.wait() == -signal.SIGKILL
    assert killed.before <= killed.after
    assert os.sched_getscheduler(0) == os.SCHED_OTHER


def test_the_longest_standstill_that_touches_a_span_counts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with ExitStack() as stack:
        monkeypatch.setattr("subprocess.Popen", lambda *_, **__: Mock())
        found = Standstills(stack, tmp_path)
    assert found.longest_ms(0, 10**9) is None
    (tmp_path / f"standstill-{min(os.sched_getaffinity(0))}").write_text(
        "1000000 3000000\n20000000 9000000\n900000000 40000000\n95"
    )
    assert found.longest_ms(2_000_000, 10_000_000) == 3.0
    assert found.longest_ms(2_000_000, 21_000_000) == 9.0
    assert found.longest_ms(50_000_000, 60_000_000) == 0.0


def test_a_kill_comes_within_the_span_that_a_robot_may_drive() -> None:
    robot = Mock()
    robot.record.off_since.return_value, robot.record.on_after.return_value = 0, None
    robot.wait_until.side_effect = lambda is_off, _what: is_off()
    Rounds(seed=1, drives_s=6.0).of("controller", robot, lambda: Killed(0, 0), count=20)
    pauses = [call.args[0] for call in robot.pause.call_args_list]
    assert len(pauses) == 20
    assert 3.0 < max(pauses) <= 6.0


@pytest.mark.slow
def test_a_robot_that_is_killed_is_off_and_another_drives(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["bench", "kills", "--what", "robot", "--rounds", "1", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["kills"]["robot"]["kills"] == printed["kills"]["robot"]["stayed_off"] == 1
    assert printed["lateness"] == {}


def test_what_is_no_part_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["bench", "kills", "--what", "node,wheel"])
    assert "wheel: expected some of node, controller, carrier, robot" in capsys.readouterr().err
