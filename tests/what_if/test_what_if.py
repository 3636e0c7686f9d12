"""What other settings or code would have said: an open loop, as numbers and as plots."""

import json
import shutil
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from xml.etree.ElementTree import fromstring

import msgspec
import pytest

from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.cli.main import main
from firmware_runtime.devs.time import SECOND, format_time
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.recording.blackbox.section import Section
from firmware_runtime.recording.board_of_recording import changed_board
from firmware_runtime.recording.replay.difference import NOTHING, Difference, in_lines
from firmware_runtime.recording.replay.open_player import Change, OpenPlayer, _carried
from firmware_runtime.recording.replay.outputs import Outputs
from firmware_runtime.recording.replay.player import Player
from firmware_runtime.recording.replay.stretch import Stretch
from firmware_runtime.recording.replay.verdict import played
from firmware_runtime.recording.what_if import watch
from firmware_runtime.recording.what_if.checkout import Answer, ask
from firmware_runtime.recording.what_if.watch import Watched, since
from firmware_runtime.recording.what_if.what_if import Question, WhatIf, answer
from firmware_runtime.recording.what_if.what_if_report import what_if_text
from firmware_runtime.runs.start import start_session
from tests.support.command import Command
from tests.support.own_interpreter import with_interpreter
from tests.support.recorded import every_section, record, rewrite
from tests.support.replayed import check_identical, opened

YAW = "controller.yaw.command_n"
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight seconds of a platform that turns, with a keyframe at 5 s."""
    # in one chunk: a keyframe begins each, and where one ends depends on what is in it
    path = tmp_path_factory.mktemp("flight") / "flight.recording"
    return record(path, "tachobot", 8, ["recording.minutes=10"])


def _asked(path: Path, *assignments: str, begin_s: float = 0, span_s: float = 60) -> WhatIf:
    begin, until = round(begin_s * SECOND), round((begin_s + span_s) * SECOND)
    return answer(
        Question(recording=str(path), assignments=[*assignments], begin=begin, until=until)
    )


@pytest.mark.slow
@pytest.mark.parametrize("board", ["tachobot", "detective", "balancing"])
def test_an_open_loop_of_nothing_changed_is_identical(tmp_path: Path, board: str) -> None:
    found = _asked(record(tmp_path / "run.recording", board, 3))
    assert (found.identical, found.outputs, found.structure) == (True, {}, {})
    assert found.steps > 100


@pytest.mark.parametrize("begin_s", [0, 6])
def test_another_gain_is_another_command_from_the_start_and_from_a_keyframe(
    flight: Path, begin_s: float
) -> None:
    found = _asked(flight, "controller.yaw.kp=0.8", begin_s=begin_s, span_s=2.5)
    assert not found.identical
    assert found.first_difference is not None
    first = found.first_difference
    assert f"{first['model']}.{first['field']}" == YAW
    assert next(in_lines(first)).startswith(f"at {format_time(first['t_ns'])} (20")
    command = found.outputs[YAW]
    assert command.count == command.of > 100
    assert command.max is not None
    assert command.rms is not None
    assert 0 < command.rms < command.max
    assert command.recorded_only == command.replayed_only == 0
    assert "i2c1 0x40" in found.outputs  # and so what is written to the outputs' chip
    assert "imu.sample" not in found.outputs  # what enters is what was recorded
    assert found.structure == {}


def test_it_is_said_whether_an_output_would_have_been_another(flight: Path) -> None:
    gains = (read_recording(flight).header.table["controller"]["yaw"]["kp"], 0.8)
    asked = (_asked(flight, f"controller.yaw.kp={gain}", span_s=1) for gain in gains)
    (_, same, *_), (_, other, *_) = (what_if_text(found, "kp") for found in asked)
    assert "no output of" in same
    assert "outputs and fields of" in other


def test_a_question_that_says_no_more_is_about_the_run_from_its_start(flight: Path) -> None:
    found = answer(Question(recording=str(flight), until=SECOND // 10))
    stated = _asked(flight, begin_s=0, span_s=0.1)
    assert (found.steps, found.events) == (stated.steps, stated.events)


def test_a_run_without_a_step_says_nothing_of_what_would_have_been(
    flight: Path, tmp_path: Path
) -> None:
    path = tmp_path / "start.recording"
    path.write_bytes(flight.read_bytes())
    rewrite(path, every_section(flight)[:2])  # built, and its chips found
    found = _asked(path)
    assert (found.steps, found.differences, found.identical) == (0, 0, False)


def test_a_keyframe_leaves_what_is_set_otherwise_and_takes_up_the_rest(flight: Path) -> None:
    recorded = read_recording(flight).header.table["controller"]["yaw"]["kp"]
    assert _asked(flight, f"controller.yaw.kp={recorded}", begin_s=6).identical
    found = _asked(flight, "controller.yaw.kp=0.8", begin_s=6)
    assert found.duration_s < 4
    assert found.first_difference is not None
    assert found.first_difference["t_ns"] >= 4 * SECOND


def test_a_gain_that_a_run_took_up_stays_so_unless_another_is_tried(tmp_path: Path) -> None:
    path, board = tmp_path / "run.recording", board_in_force("tachobot", ["recording.minutes=0.1"])
    session = start_session(
        board, VirtualClock(), doubles=True, statistics_path=None, recording=path
    )
    with closing(session):
        session.run_on(SECOND)
        session.tuning.set({"controller.yaw.kp": 0.5})
        session.run_on(6 * SECOND // 5)
    check_identical(path)
    until_then, always, beside = (
        _asked(path, assignment).outputs[YAW]
        for assignment in ("controller.yaw.kp=0.5", "controller.yaw.kp=0.9", "controller.yaw.ki=0")
    )
    assert 0 < until_then.count < until_then.of - 10
    assert always.count == always.of
    assert beside.max is not None
    assert beside.max < 0.01


def test_settings_in_tables_are_carried_key_by_key() -> None:
    given, recorded = {"a": 2, "b": 2, "c": 2}, {"a": 1, "b": 1}
    assert _carried(given, recorded, {"a": 1, "b": 3, "c": 3}) == {"a": 2, "b": 3, "c": 2}
    assert _carried(given, None, None) == given


def test_other_models_run_on_what_there_is_and_it_is_said(flight: Path) -> None:
    found = _asked(flight, "controller.mode=free")
    assert found.failure is None
    assert found.structure["chips of which nothing was recorded"] == 1
    assert found.structure["steps that were not recorded"] > 10
    assert found.outputs["esc.fault"].replayed_only > 5  # in such a step
    gone = {name: each.recorded_only for name, each in found.outputs.items() if each.recorded_only}
    assert gone["thrust_pairs.duties"] > 100
    written = sum(gone.pop(name) for name in ("i2c1 0x40", "i2c1 0x68"))
    assert found.structure["transfers no longer made"] == written
    assert found.structure["values no longer made"] == sum(gone.values())


def test_steps_in_which_a_changed_robot_has_nothing_to_do_are_said(flight: Path) -> None:
    found = _asked(flight, "controller.period_s=0.02", span_s=0.5)
    assert found.structure["steps no longer made"] == 25
    assert found.first_difference is not None
    first = {name: found.first_difference[name] for name in ("what", "recorded", "replayed")}
    assert first == {"what": "step", "recorded": "recorded", "replayed": NOTHING}


def test_what_a_step_of_its_own_asks_for_is_of_that_step_s_instant(flight: Path) -> None:
    recording, board = opened(flight)
    change = Change(changed_board(recording.header, ["controller.mode=free"]), board)
    found: list[Difference] = []

    def player(beginning: Section) -> Player:
        made = OpenPlayer(recording.header, change, Outputs(), Counter(), beginning)
        made.listeners.append(found.append)
        return made

    played(recording, player, Stretch(until=SECOND // 10), lambda _: None)
    steps = {each.at for each in found if each.what == "step" and each.recorded == NOTHING}
    assert steps & {each.at for each in found if each.what == "write"}


@pytest.mark.slow
def test_plots_show_recorded_and_replayed(flight: Path, tmp_path: Path, command: Command) -> None:
    picture, page = tmp_path / "plot.svg", tmp_path / "plot.html"
    what = ("replay", flight, "--set", "controller.yaw.kp=0.8", "--until", 2, "-o")
    assert command(*what, picture).out.startswith(
        "what if: controller.yaw.kp=0.8 (in the run 0.75)\n"
    )
    drawn = fromstring(picture.read_text())  # noqa: S314 -- our own file
    words = [each.text for each in drawn.iter("{http://www.w3.org/2000/svg}text")]
    assert words.count("recorded") == words.count("replayed") >= 3
    assert YAW in words
    assert command(*what, page).status == 0
    assert YAW in page.read_text()


@pytest.mark.slow
def test_other_code_answers_in_a_process_of_its_own(
    flight: Path, tmp_path: Path, command: Command
) -> None:
    checkout = tmp_path / "checkout"
    shutil.copytree(ROOT / "boards", checkout / "boards")
    allocation = checkout / "boards/firmware_boards/tachobot" / "attitude.py"
    allocation.write_text(allocation.read_text() + "\n")  # the same in other bytes
    what = ("replay", flight, "--with", checkout)
    assert command.document(*what)["identical"] is True
    changed = allocation.with_name("allocation.py")
    sent = "self.forces_out.send(self.forces)"
    halved = "self.forces_out.send(Forces(*(each / 2 for each in self.forces)))"
    changed.write_text(changed.read_text().replace(sent, halved))
    said = command.document(*what)
    assert said["identical"] is False
    assert said["first_difference"]["model"] == "controller.allocation"
    assert {"events", "duration_s", "outputs"} <= said.keys()
    late = command.document(*what, "--from", 6)
    assert late["outputs"].keys() == said["outputs"].keys()
    changed.write_text("is no Python")
    assert "SyntaxError" in command.refused(*what)


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("kill -9 $$", "ended by signal 9"),
        ("echo '- no such robot' >&2; exit 3", ": no such robot"),
        ("exit 3", "without a word"),
        ("echo Python", "not one of this version"),
    ],
)
def test_a_process_that_gives_no_answer_is_refused_with_what_it_said(
    flight: Path, tmp_path: Path, script: str, said: str
) -> None:
    with pytest.raises(ConfigError, match=said):
        ask(Question(recording=str(flight)), with_interpreter(tmp_path, script))


def test_an_answer_is_taken_of_a_process_that_used_the_folder(flight: Path, tmp_path: Path) -> None:
    found, written = _asked(flight, span_s=0.1), tmp_path / "answer"
    folder = with_interpreter(tmp_path, f"cat '{written}'")
    written.write_bytes(msgspec.json.encode(Answer(found, used=1)))
    assert ask(Question(recording=str(flight)), folder) == found
    written.write_bytes(msgspec.json.encode(Answer(found, used=0)))
    with pytest.raises(ConfigError, match="no module of the robot is in it"):
        ask(Question(recording=str(flight)), folder)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("added", "said"),
    [
        ("print('{seen}')", "{seen}"),
        ("def (", "SyntaxError"),
        ("import os; os.kill(os.getpid(), 9)", "ended by signal 9"),
    ],
)
def test_what_the_code_of_a_folder_prints_or_fails_with_is_said(
    flight: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    added: str,
    said: str,
) -> None:
    checkout = tmp_path / "checkout"
    shutil.copytree(ROOT / "boards", checkout / "boards")
    with (checkout / "boards/firmware_boards/tachobot" / "attitude.py").open("a") as file:
        file.write(f"\n{added}\n")
    words = ["replay", str(flight), "--until", "0.1", "--with", str(checkout), "--json"]
    is_answered = added.startswith("print")
    assert main(words) == (0 if is_answered else 2)
    printed = capfd.readouterr()
    assert said in printed.err
    assert json.loads(printed.out)["steps"] > 0 if is_answered else printed.out == ""


def test_a_folder_without_the_robots_code_is_refused(
    flight: Path, tmp_path: Path, command: Command
) -> None:
    assert "no folder" in command.refused("replay", flight, "--with", tmp_path / "none")
    with pytest.raises(ConfigError, match="none of the robot's code"):
        Watched(tmp_path, read_recording(flight).header.code)


@pytest.mark.slow
@pytest.mark.parametrize("folder", ["empty", "above"])
def test_a_folder_that_gives_no_module_is_not_answered_by_what_is_installed(
    flight: Path, tmp_path: Path, command: Command, folder: str
) -> None:
    checkout = tmp_path if folder == "empty" else ROOT.parent
    said = command.refused("replay", flight, "--until", "0.1", "--with", checkout)
    assert "no module of the robot is in it" in said


def test_a_save_is_seen_and_a_file_of_an_editor_is_not(flight: Path, tmp_path: Path) -> None:
    package = tmp_path / "boards/firmware_boards"
    package.mkdir(parents=True)
    (package / "__init__.py").write_text("")
    watched = Watched(tmp_path, read_recording(flight).header.code)
    before = watched.state()
    (package / ".model.py.swp").write_text("")
    (package / "model.pyc").write_text("")
    assert watched.state() == before
    (package / "model.py").write_text("pass\n")
    assert watched.state() != before


def test_each_answer_comes_with_how_long_it_took(
    flight: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused = ConfigError.of_one("replay", "no")

    def refuse(*_: object) -> WhatIf:
        raise refused

    monkeypatch.setattr(watch, "ask", refuse)
    monkeypatch.setattr(watch, "monotonic_ns", iter((7 * SECOND, 9 * SECOND)).__next__)
    watched = Watched(None, read_recording(flight).header.code)
    answered = watch.answers(Question(recording=str(flight)), watched)
    assert next(answered) == (refused, 2 * SECOND)


@pytest.mark.slow
def test_a_save_is_answered_and_an_interrupt_ends_it(flight: Path, tmp_path: Path) -> None:
    checkout = tmp_path / "checkout"
    shutil.copytree(ROOT / "boards", checkout / "boards")
    words = ["replay", str(flight), "--until", "1", "--with", str(checkout), "--watch"]
    with subprocess.Popen(
        [sys.executable, "-m", "firmware_runtime.cli", *words], stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            first = _answer(process)
            yaw = checkout / "boards/firmware_boards/tachobot" / "attitude.py"
            yaw.write_text(yaw.read_text() + "\n")
            second = _answer(process)
            process.send_signal(signal.SIGINT)
            assert process.wait() == 130
        finally:
            process.kill()
    assert "no output of" in first
    assert "as the last time" in second


def _answer(process: "subprocess.Popen[str]") -> str:
    """What it prints until it waits for a save."""
    assert process.stdout is not None
    lines: list[str] = []
    while not lines or "waiting for a save" not in lines[-1]:
        lines.append(process.stdout.readline())
        assert lines[-1], "it ended"
    return "".join(lines)


def test_what_is_not_as_the_last_time_is_said(flight: Path) -> None:
    first = _asked(flight, "controller.yaw.kp=0.8", span_s=1)
    second = _asked(flight, "controller.yaw.kp=0.9", span_s=1)
    assert list(since(None, first)) == []
    assert list(since(first, first)) == ["as the last time"]
    assert any(YAW in line and "->" in line for line in since(first, second))


@pytest.mark.parametrize("words", [["-o", "plot.svg"], ["--set", "x=1", "-o", "plot.txt"]])
def test_plots_of_nothing_and_of_another_kind_are_refused(
    flight: Path, words: Sequence[str], command: Command
) -> None:
    assert "expected" in command.refused("replay", flight, *words)
