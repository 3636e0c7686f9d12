"""`run --stage`, `--role` and `--link`, and `continuity`, which runs them all."""

import json
import signal
import subprocess
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from firmware_boards.tachobot.attitude import Attitude

import firmware_runtime
from firmware_runtime.board.registry import load
from firmware_runtime.cli.run_options import planned_input
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.lab.stages.stage_text import stage_line, stage_lines
from firmware_runtime.links.cut.refusal import Reason
from firmware_runtime.runs import end_link as linking
from firmware_runtime.statistics.file_header import RunState
from tests.support.command import Command, started
from tests.support.waiting import PATIENCE_S, wait_until
from tests.support.written_run import WrittenRun


def test_an_input_of_a_robot_end_elsewhere_is_refused(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("firmware_runtime.cli.staged.leads_to", lambda *_: True)
    peer = ("--peer", "localhost:7302", "--key", "x")
    assert "leads to the robot end, which runs elsewhere" in command.refused(
        "run", "tachobot", "--stage", "remote", *peer, "--input", "3:yaw_reference=1"
    )


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


def test_a_planned_input_is_written_as_it_was_read() -> None:
    for text in ("0.0:a=1", '2.5:yaw_reference={"x": "a=b:c"}'):
        assert str(planned_input(text)) == text
        assert planned_input(str(planned_input(text))) == planned_input(text)


def test_what_is_no_json_is_a_text_as_in_send() -> None:
    assert planned_input("1:a=WET").value == b'"WET"'


NAMES = {"controller": "heron.controller", "robot": "heron"}


def _document(**changed: object) -> dict[str, Any]:
    """The result of a stage, both ends of which were late once, out of two ticks."""
    run = WrittenRun()
    run.activation(0, 100_000, 0)
    run.activation(10 * MILLISECOND, 13 * MILLISECOND, 0)
    end = {"statistics": run.statistics(RunState.ENDED).as_json(), "recording": "/run/a.recording"}
    way = {"sent": 1200, "received": 1100, "age_us": {"p50": 420.0}}
    between = {"over": "udp", "between": "loopback", "impairment": None}
    return {
        "board": "heron",
        "ended": {"state": "ended", "reason": "the run reached 2 s", "by": "controller"},
        "controller": end,
        "robot": {**end, "recording": "/run/b.recording"},
        "link": {**between, "out": way, "back": {"sent": 7}},
        "result": {"height_m": 2.0},
        "outputs_on": {"wings": 0},
        **changed,
    }


def test_a_stage_ends_in_few_lines() -> None:
    lines = stage_lines(_document(), NAMES, lambda result: f"flew at {result['height_m']} m")
    did, *_wrong, outputs, controller, robot, link, recorded, further = lines
    assert (did, outputs) == ("flew at 2.0 m", "all outputs off")
    for role, said in (("controller", controller), ("robot", robot)):
        assert said == f"{role}: 1 of 2 ticks on time; the worst 13 ms late"
    assert "udp, loopback: out 1,100 of 1,200 values in 0.42 ms, back - of 7 values" in link
    assert recorded == "recorded in /run/a.recording and /run/b.recording"
    for part in ("stats heron.controller", "replay heron.controller", "the robot end is heron"):
        assert part in further


def test_a_stage_that_failed_says_whose_fault_it_was_and_what_is_not_known() -> None:
    ended = {"state": "failed", "reason": "ended with status 137", "by": "robot"}
    killed = _document(ended=ended, robot={"status": 137}, result=None, outputs_on={"wings": 2})
    lines = stage_lines(killed, NAMES, str)
    assert lines[0].startswith("heron ran for ")
    assert "failed: robot: ended with status 137" in lines
    assert "outputs still on: wings 2" in lines
    assert "robot: no statistics here" in lines
    assert "the robot end" not in lines[-1]


def test_a_stage_whose_ends_left_nothing_did_not_run() -> None:
    lines = stage_lines(_document(controller={}, robot=None, result=None), {}, None)
    assert lines[0] == "heron did not run"
    assert not any(line.startswith(("recorded", "next")) for line in lines)


def test_a_stage_that_was_stopped_says_by_what() -> None:
    ended = {"state": "stopped", "reason": "SIGINT", "by": None}
    assert "stopped: SIGINT" in stage_lines(_document(ended=ended), NAMES, None)


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


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("words", ["--role controller", "--role robot --doubles"])
def test_an_end_that_met_no_other_has_failed(words: str, tmp_path: Path, command: Command) -> None:
    link = ["--link", f"unix:{tmp_path}/link", "--statistics", f"{tmp_path}/run.stats"]
    ended = command("run", "tachobot", *words.split(), *link, "--for", "0.3")
    assert ended.status == 1
    assert "link was never ready: it has met no other end" in ended.error


@pytest.mark.parametrize(
    ("refused", "said"),
    [
        ({}, ": nothing came; expected an end that is there, with the same key if there is one"),
        ({Reason.FORGED: 3}, ": 3 datagrams came, and none was authentic: signed with another key"),
        (
            {Reason.FORGED: 1, Reason.OTHER_CUT: 2},
            ": 3 datagrams came, and all were refused (forged 1, other_cut 2)",
        ),
    ],
)
def test_an_end_that_met_no_other_says_what_came_all_the_same(
    refused: dict[Reason, int], said: str
) -> None:
    assert linking._came(refused).startswith(said)


def test_a_controller_runs_alone_in_virtual_time_for_what_is_fed_by_a_program() -> None:
    with firmware_runtime.open_board("tachobot", role="controller", clock="virtual") as robot:
        assert robot.outputs is None
        assert [*robot.model.components] == ["controller"]
        assert robot.run(1.0).statistics.link is None
    with pytest.raises(ConfigError, match="doubles: role controller has no hardware"):
        firmware_runtime.open_board("tachobot", role="controller", doubles=True)


def test_an_end_with_hardware_is_refused_without_a_link() -> None:
    with pytest.raises(ConfigError, match="drives nothing without a controller"):
        firmware_runtime.open_board("tachobot", role="robot", doubles=True, clock="virtual")


def test_a_link_is_refused_without_a_role(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="--link without --role; expected the role"):
        firmware_runtime.open_board("tachobot", doubles=True, link=f"unix:{tmp_path}/link")


def test_an_end_whose_clock_is_not_real_time_is_refused_with_a_link(tmp_path: Path) -> None:
    for clock in (firmware_runtime.VirtualClock(), firmware_runtime.ScaledClock(2.0)):
        with pytest.raises(ConfigError, match="a link lives in real time"):
            firmware_runtime.open_board(
                "tachobot", role="robot", doubles=True, clock=clock, link=f"unix:{tmp_path}/link"
            )


def test_one_path_has_one_listener(tmp_path: Path) -> None:
    link = f"unix:{tmp_path}/link"
    with firmware_runtime.open_board("tachobot", role="robot", link=link, doubles=True) as robot:
        assert robot.armed is False
        with pytest.raises(ConfigError, match="another process listens"):
            firmware_runtime.open_board("tachobot", role="robot", link=link, doubles=True)


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize(("board", "for_s"), [("tachobot", 2), ("detective", 4)])
def test_simulation_and_embedded_are_their_replays(
    command: Command, tmp_path: Path, board: str, for_s: int
) -> None:
    output = tmp_path / "certificate.json"
    stages = ("--stages", "simulation", "embedded")
    ended = command("continuity", board, "--for", for_s, "-o", output, *stages)
    said = json.loads(output.read_text())
    assert ended.status == Status.OK
    assert said["board"] == board
    assert {"simulation", "embedded"} == said["stages"].keys()
    for stage in said["stages"].values():
        assert stage["events"] > 0
        assert (stage["differences"], stage["first_difference"]) == (0, None)


WORSE = "delay=20ms,jitter=15ms,loss=10%,reorder=10%,duplicate=10%,seed=3"


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize(
    ("board", "stage", "words", "how"),
    [
        ("detective", "network", (), ""),
        ("detective", "remote", (), "delay=40ms,jitter=10ms,loss=2%"),
        ("tachobot", "remote", ("--impair", WORSE), "loss=10%"),
    ],
    ids=["good", "bad", "worse"],
)
def test_both_ends_of_a_network_are_their_replays(  # noqa: PLR0917 -- fixtures
    command: Command,
    tmp_path: Path,
    board: str,
    stage: str,
    words: tuple[str, ...],
    how: str,
) -> None:
    output = tmp_path / "certificate.json"
    ended = command("continuity", board, "--for", 3, "-o", output, "--stages", stage, *words)
    assert ended.status == Status.OK, ended
    said = json.loads(output.read_text())["stages"]
    assert said.keys() == {stage}
    assert said[stage]["ends"].keys() == {"controller", "robot"}
    assert [end["identical"] for end in said[stage]["ends"].values()] == [True, True]
    assert (said[stage]["differences"], said[stage]["first_difference"]) == (0, None)
    assert said[stage]["link"]["back"]["age_us"]["p99"] > 0
    assert how in (said[stage]["link"]["impairment"] or {"how": ""})["how"]


EXTERNAL = Attitude.external


def turned(self: Attitude, elapsed: int) -> None:
    EXTERNAL(self, elapsed)
    if self.motion is not None:
        self.motion = self.motion._replace(position=-self.motion.position)


@pytest.mark.slow
def test_code_that_acts_otherwise_is_found_and_is_the_exit_status(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Attitude, "external", turned)  # in the replay: the run is another process
    output = tmp_path / "certificate.json"
    words = ("continuity", "tachobot", "--for", 1.5, "-o", output, "--stages", "simulation")
    ended = command(*words)
    stage = json.loads(output.read_text())["stages"]["simulation"]
    assert ended.status == Status.MODEL_ERROR
    assert stage["differences"] > 0
    assert (stage["identical"], json.loads(output.read_text())["identical"]) == (False, False)
    assert stage["first_difference"]["model"].startswith("controller.")
    assert "at 0." in ended.out


@pytest.mark.slow
def test_of_a_board_without_roles_the_stages_of_one_process_are_run(
    command: Command, tmp_path: Path
) -> None:
    board, output = tmp_path / "board.toml", tmp_path / "certificate.json"
    tables = Path(load("tachobot").source).read_text().split("\n[")
    board.write_text("\n[".join(each for each in tables if not each.startswith(("roles", "link"))))
    words = ("continuity", board, "--for", 1.5, "--stages", "simulation", "network", "-o", output)
    assert command(*words).status == Status.OK
    said = json.loads(output.read_text())
    assert said["stages"].keys() == {"simulation"}
    assert "no table [roles]" in said["not_run"]["network"]


@pytest.mark.slow
@pytest.mark.real_time
def test_a_signal_ends_the_stage_under_way_too(tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    words = ["continuity", "tachobot", "--for", "600", "--stages", "network", "--keep", str(kept)]
    with started(
        *words, "-o", tmp_path / "x.json", stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as process:
        try:
            wait_until(lambda: len(processes_with(str(kept))) >= 3, "both ends are there")
            process.send_signal(signal.SIGTERM)
            assert process.wait(PATIENCE_S) == Status.TERMINATED
        finally:
            process.kill()
    wait_until(lambda: processes_with(str(kept)) == [], "no process of the stage is left")
    assert not (tmp_path / "x.json").exists()


@pytest.mark.slow
def test_folders_of_one_that_was_killed_go_at_the_next_start_which_writes_a_page(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place, kept, page = tmp_path / "temporary", tmp_path / "kept", tmp_path / "page.html"
    place.mkdir()
    monkeypatch.setenv("TMPDIR", str(place))
    monkeypatch.setattr(tempfile, "tempdir", str(place))
    words = ["continuity", "tachobot", "--for", "1.5", "--stages", "simulation", "-o", page]
    with started(*words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        wait_until(lambda: len(list(place.iterdir())) == 2, "recordings and state have a place")
        process.kill()
    left = set(place.iterdir())
    assert left
    assert command(*words, "--keep", kept).status == Status.OK
    assert left.isdisjoint(place.iterdir())
    assert command("replay", kept / "simulation.recording").status == Status.OK
    assert page.read_text().startswith("<!DOCTYPE html>")


def processes_with(word: str) -> list[str]:
    """The command lines of processes that hold this word."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            line = path.read_bytes().replace(b"\0", b" ").decode(errors="replace")
            if word in line:
                found.append(line)
    return found
