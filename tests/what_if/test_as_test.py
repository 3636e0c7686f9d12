"""A piece of a run becomes a test, as short as shows the difference, with its recording."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from firmware_boards.tachobot.allocation import Allocation
from firmware_drivers.thrust_pairs import Forces

from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.blackbox.layout import file_of
from firmware_runtime.recording.blackbox.reader import kind_of, read_recording
from firmware_runtime.recording.blackbox.section import Kind, decode, encode_sent, sent_of
from firmware_runtime.recording.replay.replay_assertion import assert_replays, difference_of
from firmware_runtime.recording.what_if.checkout import Answer
from firmware_runtime.recording.what_if.what_if import Question, answer
from tests.support.allocation import has_attribute
from tests.support.command import Command
from tests.support.own_interpreter import with_interpreter
from tests.support.recorded import every_section, in_chunks, record, rewrite
from tests.support.replayed import check_identical

GAIN = "controller.yaw.kp=0.8"
Write = Callable[..., dict[str, Any]]


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight seconds of a platform that turns, with a keyframe at 5 s."""
    return record(tmp_path_factory.mktemp("flight") / "flight.recording", "tachobot", 8)


@pytest.fixture
def write(flight: Path, tmp_path: Path, command: Command) -> Write:
    """Write a test; returns what the verb says of it."""

    def written(*words: object) -> dict[str, Any]:
        test = tmp_path / "test_that_day.py"
        said: dict[str, Any] = command.document("replay", flight, "--as-test", test, *words)
        return said

    return written


def test_a_stretch_is_kept_from_its_very_beginning_and_replays(write: Write) -> None:
    said = write("--from", 6, "--until", 6.5)
    assert 5.9 < said["from_s"] < 6
    assert (said["until_s"], said["difference"]) == (6.5, None)
    assert 50 <= said["steps"] <= 52
    check_identical(Path(said["recording"]))


def test_a_stretch_of_a_run_whose_beginning_is_lost_is_compared_as_a_whole(
    flight: Path, tmp_path: Path, command: Command
) -> None:
    path, sections = tmp_path / "late.recording", every_section(flight)
    path.write_bytes(flight.read_bytes())
    rewrite(path, sections[[*map(kind_of, sections)].index(Kind.KEYFRAME) :], number=2)
    words = ("--from", 0.8, "--until", 0.9, "--as-test", tmp_path / "test_late.py")
    check_identical(Path(command.document("replay", path, *words)["recording"]))


def test_a_piece_from_the_start_has_all_that_the_run_has_up_to_there(
    write: Write, flight: Path
) -> None:
    piece = every_section(Path(write("--until", 0.2)["recording"]))
    assert piece == every_section(flight)[: len(piece)]


def test_what_a_setting_changes_is_shown_by_one_step(write: Write) -> None:
    said = write("--set", GAIN, "--until", 1)
    assert said["steps"] == 1
    assert said["difference"]["field"] == "command_n"
    assert said["bytes"] < 100_000
    assert_replays(said["recording"])
    with pytest.raises(AssertionError, match=r"controller\.yaw\.command_n"):
        assert_replays(said["recording"], settings=[GAIN])


def test_a_change_in_the_last_digits_is_shown_too(write: Write) -> None:
    said = write("--set", "controller.yaw.ki=0.0100001", "--until", 1)
    assert said["difference"] is not None
    assert said["steps"] >= 1
    assert difference_of(Path(said["recording"]))[0] is None
    first = difference_of(Path(said["recording"]), ["controller.yaw.ki=0.0100001"])[0]
    assert first == said["difference"]


def test_what_the_code_of_a_folder_changes_is_asked_of_that_code(
    write: Write, flight: Path, tmp_path: Path
) -> None:
    found = answer(Question(recording=str(flight), assignments=[GAIN], until=SECOND))
    (tmp_path / "answer").write_bytes(msgspec.json.encode(Answer(found, used=1)))
    folder = with_interpreter(tmp_path / "checkout", f"cat '{tmp_path / 'answer'}'")
    said = write("--with", folder, "--until", 1)
    assert said["difference"] == found.first_difference is not None


@pytest.mark.slow
def test_code_that_has_changed_is_shown_from_a_recorded_keyframe(
    write: Write, monkeypatch: pytest.MonkeyPatch
) -> None:
    def halved(self: Allocation) -> None:
        forces = self.forces
        if forces[2] < 0.001:
            forces = Forces(*(each / 2 for each in forces))
        self.forces_out.send(forces)

    monkeypatch.setattr(Allocation, "output", halved)
    said = write()
    assert said["difference"]["model"] == "controller.allocation"
    with pytest.raises(AssertionError, match=r"controller\.allocation"):
        assert_replays(said["recording"])
    monkeypatch.undo()
    assert_replays(said["recording"])


@pytest.mark.slow
def test_the_file_is_a_test_that_pytest_runs(write: Write) -> None:
    said = write("--until", 0.2)
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", said["test"]]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert "1 passed" in done.stdout
    assert max(map(len, Path(said["test"]).read_text().splitlines())) <= 100


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("that day.py", []),
        ("test_that_day.txt", []),
        ("none/test_that_day.py", []),
        ("test_that_day.py", ["--speed", "1"]),
        ("test_that_day.py", ["--set", "controller.yaw.kp=0.75"]),
        ("test_that_day.py", ["--from", "60"]),
        ("test_that_day.py", ["--from", "6.0011", "--until", "6.0012"]),
    ],
)
@pytest.mark.slow
def test_what_can_be_no_test_is_refused_and_nothing_is_written(
    flight: Path, tmp_path: Path, name: str, words: list[str], command: Command
) -> None:
    said = command.refused("replay", flight, "--as-test", tmp_path / name, *words)
    assert "expected" in said
    assert list(tmp_path.iterdir()) == []


def test_what_a_run_sent_otherwise_in_its_last_step_is_shown_from_a_keyframe(
    tmp_path: Path, command: Command
) -> None:
    path = record(tmp_path / "run.recording", "tachobot", 0.8)
    number = read_recording(path).header.ports.index("controller.yaw.command_n")
    sections = [decode(each) for each in every_section(path)]
    while number not in (sent := dict(sent_of(sections[-1]))):
        sections.pop()
    pairs = (sent | {number: "another"}).items()
    sections[-1].sent = msgspec.Raw(encode_sent([part for pair in pairs for part in pair]))
    rewrite(path, [msgspec.msgpack.encode(each) for each in sections])
    said = command.document("replay", path, "--as-test", tmp_path / "test_that_day.py")
    assert (said["difference"]["field"], said["difference"]["recorded"]) == ("command_n", "another")
    assert 0.7 < said["until_s"] <= 0.8
    with pytest.raises(AssertionError, match="another"):
        assert_replays(said["recording"])


def test_a_test_is_not_written_over(write: Write, flight: Path, command: Command) -> None:
    said = write("--until", 0.2)
    command.refused("replay", flight, "--as-test", said["test"])
    assert difference_of(Path(said["recording"])) == (None, [])


def test_a_stretch_whose_state_cannot_be_kept_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    has_attribute(monkeypatch, "numbers", lambda _: (number for number in range(3)))
    path = record(tmp_path / "run.recording", "tachobot", 1.0)
    test = tmp_path / "test_that_day.py"
    said = command.refused("replay", path, "--from", "0.5", "--as-test", test)
    assert said.count("\n") == 1
    assert "cannot be kept where the stretch begins; expected one from the run's start" in said
    assert command("replay", path, "--as-test", test).status == 0


def test_what_the_runs_recording_lacks_is_said_and_stands_in_the_test(
    tmp_path: Path, command: Command
) -> None:
    path, test = record(tmp_path / "run.recording", "tachobot", 0.2), tmp_path / "test_that_day.py"
    path.write_bytes(in_chunks(path, 10))
    chunks = read_recording(path).chunks
    path.write_bytes(file_of([*chunks[:2], *chunks[3:]]))
    (lacking,) = read_recording(path).faults()
    assert command.document("replay", path, "--as-test", test)["faults"] == [lacking]
    assert test.read_text().startswith(f'"""{read_recording(path).header.run}, ')
    assert f"recording is not whole: {lacking}" in " ".join(test.read_text().split())
