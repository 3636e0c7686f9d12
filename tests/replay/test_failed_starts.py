"""A start that fails since a chip is missing or another one leaves a recording, and is replayed."""

from collections.abc import Callable
from pathlib import Path

import pytest
from firmware_boards.tachobot.allocation import Allocation
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.pca9685 import Pca9685

from firmware_runtime.board import registry
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.errors import FirmwareRuntimeError, text_of
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.hal.wire_errors import BusFault, HalError
from firmware_runtime.recording.blackbox.locations import (
    find_recording,
    recording_of_virtual_run,
)
from firmware_runtime.recording.blackbox.reader import read_recording
from firmware_runtime.runs import black_box, kept_recordings
from firmware_runtime.runs.hardware import Hardware
from firmware_runtime.runs.recorded_edge import RecordedEdge
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session
from sim_doubles.chips.mpu9250_registers import power_up
from tests.support.command import Command
from tests.support.recorded import record
from tests.support.replayed import replayed

FOREIGN = "sim_doubles.chips.mpu9250.power_up"


@pytest.fixture
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path / "state"))
    return tmp_path / "state"


def fail_to_start(path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Start TachoBot with another chip where its IMU should be."""
    with monkeypatch.context() as patched:
        patched.setattr(FOREIGN, lambda _: power_up(0x12))
        with pytest.raises(HalError) as caught:
            record(path, "tachobot", 0.1)
    return str(caught.value)


def test_a_start_that_failed_is_replayed_as_the_last_run_of_its_board(
    state: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = fail_to_start(recording_of_virtual_run("tachobot"), monkeypatch)
    path = find_recording("tachobot")
    assert path == state / "tachobot.start.recording"
    assert [each.number for each in read_recording(path).chunks] == [1]
    verdict = replayed(path)
    assert verdict.is_identical
    assert (verdict.steps, verdict.failure) == (0, said)
    assert verdict.writes > 0


def test_the_run_before_it_is_still_there(state: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run = recording_of_virtual_run("tachobot")
    record(run, "tachobot", 0.1)
    before = read_recording(run).header.run
    fail_to_start(run, monkeypatch)
    assert read_recording(run).header.run == before
    assert sorted(each.name for each in state.iterdir()) == [
        "tachobot.start.recording",
        "tachobot.virtual.recording",
    ]


def raise_in_bring_up(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    """Let the IMU's driver fail when it has asked its chip."""
    identify = Mpu9250.identify

    def identified(self: Mpu9250) -> None:
        identify(self)
        raise error

    monkeypatch.setattr(Mpu9250, "identify", identified)


@pytest.mark.parametrize(
    "error", [ValueError("range 7"), KeyError("gain"), ModelError("a bug"), BusFault("i2c1 stuck")]
)
def test_whatever_a_driver_raises_in_its_bring_up_is_replayed(
    state: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    raise_in_bring_up(monkeypatch, error)
    with pytest.raises(FirmwareRuntimeError) as caught:
        record(recording_of_virtual_run("tachobot"), "tachobot", 0.1)
    verdict = replayed(find_recording("tachobot"))
    said = text_of(caught.value)
    assert (verdict.is_identical, verdict.failure, verdict.end) == (True, said, said)
    assert verdict.writes > 0
    assert [each.name for each in state.iterdir()] == ["tachobot.start.recording"]


def test_a_start_that_is_broken_off_is_replayed(
    state: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    with monkeypatch.context() as patched:
        raise_in_bring_up(patched, KeyboardInterrupt())
        with pytest.raises(KeyboardInterrupt):
            record(recording_of_virtual_run("tachobot"), "tachobot", 0.1)
    ended = command("replay", "tachobot")
    assert (ended.status, "the run had failed: KeyboardInterrupt" in ended.out) == (0, True)
    assert (state / "tachobot.start.recording").exists()


def test_an_enable_line_that_cannot_be_set_leaves_a_recording(
    state: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def enable(_: Hardware, *, enabled: bool) -> None:
        raise BusFault(f"gpio 17 cannot be set to {enabled}")

    with monkeypatch.context() as patched:
        patched.setattr(Hardware, "enable", enable)
        with pytest.raises(BusFault):
            record(recording_of_virtual_run("tachobot"), "tachobot", 0.1)
    verdict = replayed(state / "tachobot.start.recording")
    assert (verdict.first, verdict.faults) == (None, [])
    assert (verdict.is_identical, verdict.end) == (True, "gpio 17 cannot be set to True")


def test_a_model_whose_initial_state_raises_leaves_none_since_no_chip_was_asked(
    state: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def initialize(_: Allocation) -> None:
        raise ValueError("no state")

    monkeypatch.setattr(Allocation, "initialize", initialize)
    with pytest.raises(Exception, match="no state"):
        record(recording_of_virtual_run("tachobot"), "tachobot", 0.1)
    assert not state.exists()


def test_verbs_take_it(state: Path, monkeypatch: pytest.MonkeyPatch, command: Command) -> None:
    said = fail_to_start(recording_of_virtual_run("tachobot"), monkeypatch)
    ended = command("replay", "tachobot")
    assert (ended.status, said in ended.out) == (0, True)
    (row,) = command.document("recordings", "list")
    assert (row["name"], row["why"], row["end"], row["whole"]) == (
        *("tachobot", "start", "failed"),
        True,
    )
    assert command.document("replay", "tachobot")["identical"] is True
    assert row["file"] == str(state / "tachobot.start.recording")


def test_a_start_that_cannot_be_recorded_fails_for_its_own_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    assert "WHO_AM_I" in fail_to_start(tmp_path / "file" / "tachobot.recording", monkeypatch)


def raise_on_chip(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    """Let the first step fail, that makes sure that no output is on."""

    def silence(_: Pca9685) -> None:
        raise error

    monkeypatch.setattr(Pca9685, "silence", silence)


def raise_at_enable_line(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    enable = Hardware.enable

    def enabled(self: Hardware, *, enabled: bool) -> None:
        enable(self, enabled=enabled)
        if enabled:
            raise error

    monkeypatch.setattr(Hardware, "enable", enabled)


def raise_as_the_box_opens(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    def opened(_: RecordedEdge) -> None:
        raise error

    monkeypatch.setattr(RecordedEdge, "open", opened)


@pytest.mark.parametrize("error", [BusFault("i2c1 stuck"), MemoryError(), KeyboardInterrupt()])
@pytest.mark.parametrize(
    "fails", [raise_on_chip, raise_in_bring_up, raise_as_the_box_opens, raise_at_enable_line]
)
def test_outputs_go_off_and_hardware_closes_before_a_file_is_written(
    state: Path,
    monkeypatch: pytest.MonkeyPatch,
    fails: Callable[[pytest.MonkeyPatch, BaseException], None],
    error: BaseException,
) -> None:
    done = noted(monkeypatch)
    fails(monkeypatch, error)
    path = recording_of_virtual_run("tachobot")
    with pytest.raises((FirmwareRuntimeError, type(error))):
        record(path, "tachobot", 0.1)
    copied = ["copied"] if fails is raise_at_enable_line else []
    assert done == [*copied, "off", "closed", *copied, "written"]
    assert [each.name for each in state.iterdir()] == ["tachobot.start.recording"]


def test_what_was_opened_and_never_ran_is_off_before_it_closes(
    state: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = noted(monkeypatch)

    def before(_: Session) -> None:
        raise ValueError("an input that is none")

    with pytest.raises(ValueError, match="none"):
        record(recording_of_virtual_run("tachobot"), "tachobot", 0.1, before=before)
    assert done == ["copied", "off", "closed", "copied"]
    assert not state.exists()


def test_outputs_that_cannot_be_switched_off_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def stuck(_: Pca9685) -> None:
        raise BusFault("i2c1 stuck")

    monkeypatch.setattr(Pca9685, "stop_all", stuck)
    raise_on_chip(monkeypatch, BusFault("i2c1 is stuck"))
    said: list[str] = []
    board = registry.load("tachobot")
    with pytest.raises(BusFault, match="is stuck"):
        start_session(board, VirtualClock(), doubles=True, statistics_path=None, log=said.append)
    assert said == ["warning: not made safe: i2c1 stuck"]


def noted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is done, in order, as it has been done."""
    done: list[str] = []

    def note(where: object, name: str, what: str) -> None:
        does = getattr(where, name)

        def noting(*arguments: object) -> object:
            found = does(*arguments)
            done.append(what)
            return found

        monkeypatch.setattr(where, name, noting)

    note(Robot, "make_safe", "off")
    note(Hardware, "close", "closed")
    note(kept_recordings, "replace_file", "written")
    note(black_box, "keep", "copied")
    return done
