"""The bench kills, says when outputs were off by the doubles' record, and leaves nothing behind."""

import json
from pathlib import Path

import pytest

from benchmarks.kills.kills import Kills
from benchmarks.kills.record import FLICKER, OutputRecord
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
    kills.note(0, 500 * MILLISECOND, None)
    kills.note(0, 520 * MILLISECOND, 900 * MILLISECOND)
    found = kills.report()
    assert (found["kills"], found["within"], found["stayed_off"]) == (2, 1, 1)
    assert (found["median_ms"], found["worst_ms"]) == (510.0, 520.0)


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
