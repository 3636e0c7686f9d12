import json
import sys
from pathlib import Path

import pytest
from firmware_boards.detective.detective import MODEL_FILE

from tests.support import figure_6
from tests.support.command import Command
from tests.support.virtual_detective import NEAR

pytestmark = pytest.mark.slow

VIRTUAL = ("run", "detective", "--doubles", "--clock", "virtual")


@pytest.fixture
def events(tmp_path: Path) -> Path:
    path = tmp_path / "figure6.ev"
    path.write_text(figure_6.EVENTS)
    return path


@pytest.mark.parametrize("clock", [(), ("--clock", "scaled", "--speed", "40")])
@pytest.mark.parametrize("model", ["own", "file"])
def test_figure_6_comes_out_line_by_line(
    command: Command, events: Path, tmp_path: Path, clock: tuple[str, ...], model: str
) -> None:
    outputs = tmp_path / "figure6.out"
    run = MODEL_FILE if model == "file" else "detective"
    ended = command("run", run, "--events", events, "--outputs", outputs, *clock)
    assert (ended.status, ended.error) == (0, "")
    assert outputs.read_text() == figure_6.OUTPUTS


def test_without_outputs_the_lines_go_to_the_screen(command: Command, events: Path) -> None:
    assert command("run", "detective", "--events", events).out == figure_6.OUTPUTS


def test_for_ends_the_run_early(command: Command, events: Path) -> None:
    ended = command("run", "detective", "--events", events, "--for", "5.03")
    assert ended.out == "".join(figure_6.OUTPUTS.splitlines(keepends=True)[:4])


def test_a_trace_of_events_has_what_every_port_of_the_model_sent(
    command: Command, events: Path, tmp_path: Path
) -> None:
    path = tmp_path / "trace.jsonl"
    ended = command("run", "detective", "--events", events, "--trace", path)
    assert (ended.status, ended.out) == (0, figure_6.OUTPUTS)
    sent = [json.loads(line) for line in path.read_text().splitlines()]
    assert [each["value"] for each in sent if each["port"] == "events.In1"] == [1.0]
    assert any(each["port"].startswith("top.RadarSystem.") for each in sent)


def test_events_in_any_order_are_the_same_run(
    command: Command, events: Path, tmp_path: Path
) -> None:
    shuffled = tmp_path / "shuffled.ev"
    shuffled.write_text("  ".join(reversed(events.read_text().splitlines())))
    assert command("run", "detective", "--events", shuffled).out == figure_6.OUTPUTS


def test_a_bad_event_file_is_refused_with_file_and_line(command: Command, tmp_path: Path) -> None:
    path = tmp_path / "bad.ev"
    path.write_text("00:00:02:00 In1 1\n00:00:01:00 In9 x\n")
    ended = command("run", "detective", "--events", path)
    assert ended.status == 2
    assert str(path) in ended.error
    assert "line 2" in ended.error
    assert ended.out == ""


def test_it_drives_to_the_target_and_says_where_it_stopped(command: Command) -> None:
    ended = command(*VIRTUAL, "--set", "world.target=[2.0, 1.0]", "--json")
    document = json.loads(ended.out)
    assert (ended.status, ended.error) == (0, "")
    assert set(document["result"]) == {"found", "stopped_m", "turned_deg", "time_s"}
    assert document["result"]["found"] is True
    assert 0.05 < document["result"]["stopped_m"] < 0.5
    assert document["ended"] == {"state": "stopped", "reason": "the target was reached"}
    assert document["outputs_on"] == {"radar_motor": 0, "treads": 0}


def test_a_failure_is_reported_on_the_exit_line_and_in_the_statistics(
    command: Command, tmp_path: Path
) -> None:
    stuck = ("--set", "world.body_compass_stuck_s=2")
    path = tmp_path / "kept.stats"
    ended = command(*VIRTUAL, *stuck, "--json", "--statistics", path)
    assert ended.status == 1
    assert "readings in a row, expected some noise" in ended.error
    assert json.loads(ended.out)["result"]["found"] is False
    kept = json.loads(command("stats", "--statistics", path, "--json").out)
    assert "readings in a row, expected some noise" in kept["conditions"]["run"]["reason"]


def test_a_failure_may_leave_the_run_going_with_its_motors_stopped(
    command: Command,
) -> None:
    stuck = ("--set", "world.body_compass_stuck_s=5")
    ended = command(*VIRTUAL, *stuck, "--set", "mission.on_failure=wait", "--for", 20, "--json")
    document = json.loads(ended.out)
    assert ended.status == 0
    assert document["ended"]["state"] == "ended"
    assert document["result"]["found"] is False
    assert document["result"]["time_s"] == 20.0


@pytest.mark.parametrize(
    ("ending", "begin"),
    [("svg", b"<?xml"), ("png", b"\x89PNG"), ("html", b"<!DOCTYPE html>"), ("json", b'{"title":')],
)
def test_a_run_can_be_drawn(command: Command, tmp_path: Path, ending: str, begin: bytes) -> None:
    path = tmp_path / f"run.{ending}"
    assert command(*VIRTUAL, *NEAR, "--plot", path).status == 0
    assert path.read_bytes().startswith(begin)
    assert ending == "png" or "It found the target" in path.read_text()


def test_a_picture_of_a_failed_mission_says_so_and_why(command: Command, tmp_path: Path) -> None:
    path = tmp_path / "run.json"
    stuck = ("--set", "world.body_compass_stuck_s=5")
    ended = command(*VIRTUAL, *stuck, "--plot", path, "--json")
    assert ended.status == 1
    [outcome] = json.loads(path.read_text())["opening"]
    assert outcome["text"].startswith("It did not find the target")
    assert json.loads(ended.out)["ended"]["reason"] in outcome["text"]


def test_a_picture_without_its_extra_is_refused_before_the_run(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert "expected the extra plot" in command.refused(*VIRTUAL, "--plot", tmp_path / "run.svg")


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        (("detective", "-o", "FILE.svg"), "movementController"),
        (("detective", "-o", "FILE.mmd"), "movementController"),
        (("detective", "--state", "radar_controller", "-o", "FILE.svg"), "Ask motor1 to"),
        (("detective", "--whole", "-o", "FILE.svg"), "radar_motor"),
        (("tachobot", "-o", "FILE.svg"), "thrust_pairs"),
    ],
)
def test_diagrams_are_drawn_from_the_model(
    command: Command, tmp_path: Path, arguments: tuple[str, ...], part: str
) -> None:
    paths = [each.replace("FILE", str(tmp_path / "picture")) for each in arguments]
    ended = command("show", *paths)
    assert ended.status == 0
    assert part in Path(paths[-1]).read_text()


@pytest.mark.parametrize(
    ("override", "reason"),
    [
        ("world.walls=[[0,0,0,0]]", "expected finite x and y of two different ends"),
        ("world.obstacles=[[0,0,1]]", "expected a place where the vehicle"),
        ("world.obstacles=[[1,1,-1]]", "a radius above 0"),
        ("world.right_slip=2", "world.right_slip: 2: expected float <= 0.9"),
        ("world.sonar_nearest_m=7", "expected more than sonar_nearest_m"),
        ("mission.start_s=1e300", "mission.start_s"),
        ("treads.address=0x10", "MD25 at 0x10 on i2c1: address: 0x10, expected 0x58 to 0x5f"),
        ("world.body_compass_stuck_s=1e300", "world.body_compass_stuck_s"),
    ],
)
@pytest.mark.parametrize("verb", [VIRTUAL, ("check", "detective")])
def test_a_value_that_only_shows_in_what_is_built_is_refused_with_a_reason(
    command: Command, verb: tuple[str, ...], override: str, reason: str
) -> None:
    ended = command(*verb, "--set", override)
    assert ended.status == 2
    assert reason in ended.error
    assert ended.out == ""
