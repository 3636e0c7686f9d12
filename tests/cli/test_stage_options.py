"""`run --stage` and `--input`: what fits a stage, what is refused, and what it prints."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.cli.run_options import planned_input
from firmware_runtime.devs.time import SECOND
from firmware_runtime.lab.stages.stage_text import end_text, stage_line

Command = Callable[..., Any]


@pytest.mark.parametrize(
    ("words", "faults"),
    [
        (("simulation", "--clock", "scaled", "--speed", "4"), 2),
        (("simulation", "--arm"), 1),
        (("simulation", "--doubles", "somewhere"), 1),
        (("simulation", "--link", "udp:127.0.0.1:7302"), 1),
        (("network", "--link", "udp:127.0.0.1:7302"), 1),
        (("network", "--link", "unix:here"), 1),
        (("remote", "--link", "ros2"), 1),
        (("embedded", "--impair", "loss=1%"), 1),
        (("embedded", "--role", "robot"), 1),
        (("network", "--plot", "x.svg", "--statistics", "x.stats", "--supervised"), 3),
        (("network", "--peer", "localhost:7302", "--key", "x"), 2),
        (("network", "--events", "x.ev"), 1),
        (("remote", "--key", "x"), 1),
        (("remote", "--peer", "localhost:7302"), 1),
        (("remote", "--peer", "localhost:7302", "--key", "x", "--impair", "loss=1%"), 1),
        (("remote", "--impair", "delay=1,loss=2"), 2),
    ],
)
def test_what_does_not_fit_a_stage_is_refused(
    command: Command, words: tuple[str, ...], faults: int
) -> None:
    ended = command("run", "tachobot", "--stage", *words)
    assert ended.status == 2
    assert ended.out == ""
    assert f"run: {faults} fault" in ended.error


@pytest.mark.parametrize(
    ("planned", "fault"),
    [
        ("3:yaw_referense=1", "yaw_referense: no such input port"),
        ("3:yaw_reference=east", "yaw_reference: not a float"),
        ("30:yaw_reference=1", "expected an earlier second"),
    ],
)
def test_an_input_that_no_end_would_take_is_refused_before_an_end_is_started(
    command: Command, planned: str, fault: str
) -> None:
    ended = command("run", "tachobot", "--stage", "network", "--for", "9", "--input", planned)
    assert ended.status == 2
    assert fault in ended.error
    assert ended.out == ""


def test_an_input_of_a_robot_end_elsewhere_is_refused(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("firmware_runtime.cli.staged.leads_to", lambda *_: True)
    peer = ("--peer", "localhost:7302", "--key", "x")
    ended = command("run", "tachobot", "--stage", "remote", *peer, "--input", "3:yaw_reference=1")
    assert ended.status == 2
    assert "leads to the robot end, which runs elsewhere" in ended.error


@pytest.mark.parametrize("option", ["--peer", "--key", "--impair"])
def test_what_belongs_to_a_stage_is_refused_without_one(command: Command, option: str) -> None:
    ended = command("run", "tachobot", "--doubles", option, "x")
    assert ended.status == 2
    assert f"{option} belongs to --stage remote" in ended.error


def test_a_loop_takes_two_ends(command: Command) -> None:
    ended = command("run", "tachobot", "--loop", "--doubles")
    assert ended.status == 2
    assert "--loop belongs to --role" in ended.error


def test_an_unknown_stage_is_refused(command: Command) -> None:
    ended = command("run", "tachobot", "--stage", "simulatoin")
    assert ended.status == 2
    assert "simulation" in ended.error


def test_a_simulation_is_a_run_on_doubles_in_virtual_time(command: Command) -> None:
    ended = command("run", "tachobot", "--stage", "simulation", "--for", "2", "--json")
    found = json.loads(ended.out)
    assert ended.status == 0
    assert (found["stage"], found["clock"], found["link"]) == ("simulation", "virtual", None)
    assert found["controller"]["statistics"]["run"] == found["statistics"]["run"] > 0
    assert found["robot"]["outputs_on"] == {"thrust_pairs": 0}
    assert found["result"]["yaw_rad"] is not None


def test_an_input_arrives_at_its_instant(command: Command, tmp_path: Path) -> None:
    trace = tmp_path / "trace.jsonl"
    zero = ("--set", "controller.yaw.reference_rad=0")
    words = ("--for", "2", "--input", "1.505:yaw_reference=1", "--trace", trace)
    assert command("run", "tachobot", "--stage", "simulation", *zero, *words).status == 0
    commands = [
        message
        for message in map(json.loads, trace.read_text().splitlines())
        if message["port"] == "controller.yaw.command_n"
    ]
    before = [abs(each["value"]) for each in commands if each["t_ns"] <= 1.5 * SECOND]
    after = [each["value"] for each in commands if each["t_ns"] > 1.5 * SECOND]
    assert max(before) < 0.1
    assert after[0] > 0.5


def test_inputs_that_the_model_does_not_take_are_refused_at_once(command: Command) -> None:
    inputs = ("--input", "1:yaw=1", "--input", "1:yaw_reference=true")
    ended = command("run", "tachobot", "--stage", "simulation", *inputs)
    assert ended.status == 2
    assert "2 faults" in ended.error


def test_a_word_for_a_number_is_refused_as_what_it_is(command: Command) -> None:
    ended = command("run", "tachobot", "--stage", "simulation", "--input", "1:yaw_reference=two")
    assert ended.status == 2
    assert "yaw_reference: not a float" in ended.error


@pytest.mark.parametrize("text", ["yaw=1", "-1:yaw=1", "nan:yaw=1", "1:yaw", "1:=1", "1e10:yaw=1"])
def test_a_planned_input_that_is_none_is_bad_usage(command: Command, text: str) -> None:
    assert command("run", "tachobot", "--doubles", f"--input={text}").status == 2


@pytest.mark.parametrize("stage", ["simulation", "network"])
def test_an_input_after_the_end_is_refused(command: Command, stage: str) -> None:
    words = ("--stage", stage, "--for", "2", "--input=2.5:yaw_reference=1")
    refused = command("run", "tachobot", *words)
    assert refused.status == 2
    assert refused.out == ""


def test_a_planned_input_is_written_as_it_was_read() -> None:
    for text in ("0.0:a=1", '2.5:yaw_reference={"x": "a=b:c"}'):
        assert str(planned_input(text)) == text
        assert planned_input(str(planned_input(text))) == planned_input(text)


def test_what_is_no_json_is_a_text_as_in_send() -> None:
    assert planned_input("1:a=WET").value == b'"WET"'


@pytest.mark.parametrize("peer", ["nohost", "127.0.0.1:99999", "127.0.0.1:7302"])
def test_a_peer_or_key_that_is_none_is_refused_before_anything_starts(
    command: Command, tmp_path: Path, peer: str
) -> None:
    words = ("--peer", peer, "--key", str(tmp_path / "missing"))
    refused = command("run", "tachobot", "--stage", "remote", *words)
    assert refused.status == 2
    assert "link:" not in refused.out


def test_what_an_end_ran_skipped_and_coalesced_is_shown() -> None:
    late = {"p50": 1.0, "p99": 2.0}
    counts = {"scheduled": 6, "run": 1, "skipped": 2, "coalesced": 3, "overruns": 4}
    ended = {"state": "stopped", "reason": "SIGTERM"}
    end = {"ended": ended, "statistics": {**counts, "lateness_us": late}}
    (line,) = end_text("robot", end, None)
    assert "1 of 6 activations run, 2 skipped, 3 coalesced, 4 late" in line
    assert "SIGTERM" in line
    (line,) = end_text("robot", end, "controller")
    assert "the controller had ended" in line
    ended["reason"] = "the target was reached"
    (line,) = end_text("robot", end, "controller")
    assert "the target was reached" in line


def test_the_line_shows_both_ends() -> None:
    assert stage_line({}, 10.0) == "starting"
    controller = {"now_ns": SECOND, "overruns": 1, "faults": 0, "value": None, "shown": None}
    robot = {"overruns": 0, "faults": 2, "value": 0.5, "shown": "world.yaw_rad", "armed": True}
    good = {"link": {"why_bad": None, "age_us": 420.0}}
    assert stage_line({"controller": {**controller, **good}, "robot": robot}, 10.0) == (
        "1.0 of 10 s  yaw_rad 0.5  armed  late 1+0  faults 0+2  link good, age 0.42 ms"
    )
    bad = {"link": {"why_bad": "the robot has been silent for 1.0 s"}}
    line = stage_line({"controller": {**controller, **bad}, "robot": {**robot, "armed": False}}, 10)
    assert line.endswith(
        "disarmed  late 1+0  faults 0+2  link: the robot has been silent for 1.0 s"
    )
