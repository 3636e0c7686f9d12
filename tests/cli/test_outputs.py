"""Switching off from another process: every chip that can be reached, whatever became of others."""

import json
import os
from collections.abc import Sequence
from pathlib import Path

import pytest

from firmware_runtime.board import registry
from firmware_runtime.board.registry import Board
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import BusAbsent, BusFault
from firmware_runtime.runs import open_lines as lines
from firmware_runtime.runs import outputs as switching
from firmware_runtime.runs.outputs import (
    Outputs,
    forget_settings,
    keep_settings,
    kept_for,
    kept_settings,
    switched_off,
)

TWO_BUSES = (
    "controller.mode=free",
    "buses.other.device=/dev/i2c-7",
    "buses.other.speed_hz=400000",
    "esc.bus=other",
)


class NotedBus(I2cBus):
    """Notes who is written to."""

    def __init__(self, name: str, addresses: list[int]) -> None:
        self.name = name
        self._addresses = addresses

    def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
        self._addresses.append(address)
        return bytes(sum(each for each in messages if isinstance(each, int)))


@pytest.mark.parametrize(("gone", "reached"), [("i2c1", 0x41), ("other", 0x40)])
def test_a_bus_that_is_gone_does_not_keep_the_other_from_being_switched_off(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, gone: str, reached: int
) -> None:
    addresses: list[int] = []

    def open_i2c(name: str, path: str, *, timeout_ms: int, alone: bool) -> I2cBus:
        assert (timeout_ms, alone) == (100, False)
        if name == gone:
            raise BusAbsent(f"{name}: {path} does not exist")
        return NotedBus(name, addresses)

    monkeypatch.setattr(lines, "open_i2c", open_i2c)
    outputs = Outputs(registry.load("tachobot", TWO_BUSES), None, tmp_path / "x.stats")
    (failed,) = outputs.make_safe()
    assert failed.startswith(f"{gone} 0x4")
    assert failed.endswith("does not exist")
    assert set(addresses) == {reached}


def agrees(outputs: Outputs, run: dict[str, list[str]]) -> bool:
    """Whether nothing but that no doubles are served speaks against it."""
    return "no doubles are served here" in str(outputs.why_unguarded(run))


def test_a_run_that_drives_other_chips_cannot_be_switched_off_from_here(tmp_path: Path) -> None:
    doubles = tmp_path / "doubles.socket"
    outputs = Outputs(registry.load("tachobot"), doubles, tmp_path / "x.stats")
    moved = registry.load("tachobot", ["thrust_pairs.address=0x42"])
    against = outputs.why_unguarded({"switched_off": switched_off(moved, doubles)})
    assert against is not None
    assert f"{doubles} i2c1 0x42: fd10, here by" in against
    tuned = registry.load("tachobot", ["controller.yaw.kp=0.5"])
    assert agrees(outputs, {"switched_off": switched_off(tuned, doubles)})


def test_a_run_whose_bus_cannot_be_opened_is_out_of_reach(tmp_path: Path) -> None:
    board = registry.load("tachobot", ["buses.i2c1.device=/dev/i2c-none"])
    outputs = Outputs(board, None, tmp_path / "x.stats")
    assert outputs.why_unguarded({"switched_off": switched_off(board, None)}) is None
    with pytest.raises(BusAbsent, match="i2c1: /dev/i2c-none cannot be opened"):
        outputs.reach()


def test_doubles_that_are_served_are_left_to_the_run_too(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shared: list[bool] = []

    def asked(_board: Board, _path: Path, *, alone: bool) -> None:
        shared.append(not alone)
        raise BusAbsent("nobody serves here")

    monkeypatch.setattr(switching, "served_doubles", asked)
    outputs = Outputs(registry.load("tachobot"), tmp_path / "doubles.socket", tmp_path / "x.stats")
    assert outputs.make_safe() == ["nobody serves here"]
    assert shared == [True]


def test_settings_that_the_run_keeps_count_from_then_on(tmp_path: Path) -> None:
    statistics, doubles = tmp_path / "x.stats", tmp_path / "doubles.socket"
    outputs = Outputs(registry.load("tachobot"), doubles, statistics)
    moved = registry.load("tachobot", ["thrust_pairs.address=0x42"])
    run = {"switched_off": switched_off(moved, doubles)}
    assert not agrees(outputs, run)
    keep_settings(moved, statistics)
    assert agrees(outputs, run)
    forget_settings(statistics)
    assert agrees(outputs, run)


def test_kept_settings_are_those_of_the_run_overrides_included(tmp_path: Path) -> None:
    statistics = tmp_path / "state" / "detective.stats"
    board = registry.load("detective", ["treads.speed=0.05"])
    keep_settings(board, statistics)
    kept = kept_settings(statistics)
    assert kept is not None
    assert kept.settings == board.settings
    forget_settings(statistics)
    assert kept_settings(statistics) is None


@pytest.mark.parametrize("content", ["", "[]", '{"board": "tachobot"}', "\udc80"])
def test_what_is_no_settings_is_none(tmp_path: Path, content: str) -> None:
    path = tmp_path / "tachobot.settings"
    path.write_text(content, encoding="utf-8", errors="surrogateescape")
    assert kept_settings(tmp_path / "tachobot.stats") is None


def test_settings_that_cannot_be_kept_are_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(StatisticsFileError, match=r"x\.settings: .*; expected a place to write"):
        keep_settings(registry.load("tachobot"), tmp_path / "file" / "x.stats")


def test_doubles_that_are_not_served_are_one_sentence(tmp_path: Path) -> None:
    outputs = Outputs(registry.load("tachobot"), tmp_path / "d.socket", tmp_path / "x")
    (failed,) = outputs.make_safe()
    assert "d.socket" in failed


def test_kept_settings_are_for_the_group_and_not_for_others(tmp_path: Path) -> None:
    before = os.umask(0)
    keep_settings(registry.load("tachobot"), tmp_path / "x.stats")
    os.umask(before)
    assert (tmp_path / "x.settings").stat().st_mode & 0o777 == 0o640


def test_settings_are_found_by_the_file_they_came_from(tmp_path: Path) -> None:
    """Also where it lies in a folder that is given, is reached by a link, or has gone."""
    folder, state = tmp_path / "mine", tmp_path / "state"
    folder.mkdir()
    file = folder / "board.toml"
    file.write_bytes(registry.load("tachobot").source.read_bytes())
    link = tmp_path / "link.toml"
    link.symlink_to(file)
    keep_settings(registry.load(str(link)), state / "tachobot.stats")
    file.unlink()
    for meant in (file, folder, link):
        assert kept_for(str(meant), [tmp_path, state]) == [state / "tachobot.stats"]
    assert kept_for(str(tmp_path / "another.toml"), [tmp_path, state]) == []


def test_settings_as_earlier_versions_kept_them_are_taken(tmp_path: Path) -> None:
    table = registry.load("tachobot").table
    (tmp_path / "x.settings").write_text(json.dumps(table))
    assert kept_settings(tmp_path / "x.stats") is not None
    assert kept_for("tachobot", [tmp_path]) == []


def test_a_fifo_in_place_of_settings_is_none(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "x.settings")
    assert kept_settings(tmp_path / "x.stats") is None


@pytest.mark.parametrize("opens_again", [False, True])
def test_a_bus_that_cannot_be_opened_again_is_used_as_it_is_and_else_closed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, *, opens_again: bool
) -> None:
    """No descriptor, no memory, no leave any more: what is open still works."""
    addresses: list[int] = []
    closed: list[I2cBus] = []

    class FailingOnce(NotedBus):
        def close(self) -> None:
            closed.append(self)

        def transaction(self, address: int, messages: Sequence[Message]) -> bytes:
            super().transaction(address, messages)
            if len(addresses) == 1:
                raise BusFault("i2c1 0x40: the adapter reported a fault")
            return b""

    opened: list[I2cBus] = []

    def open_i2c(name: str, path: str, *, timeout_ms: int, alone: bool) -> I2cBus:
        assert (timeout_ms, alone) == (100, False)
        if opened and not opens_again:
            raise BusAbsent(f"{name}: {path} cannot be opened (Too many open files)")
        opened.append(FailingOnce(name, addresses))
        return opened[-1]

    monkeypatch.setattr(lines, "open_i2c", open_i2c)
    board = registry.load("tachobot", ["buses.i2c1.attempts=1"])
    outputs = Outputs(board, None, tmp_path / "x.stats")
    outputs.prepare()
    assert outputs.make_safe() == ["i2c1 0x40: the adapter reported a fault"]
    assert outputs.make_safe() == []
    assert addresses == [0x40] * 3
    assert closed == opened[:-1]
