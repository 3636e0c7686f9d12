"""Clocks of wires, timed on doubles whose buses have a known clock, and what is made of them."""

import json
import os
from itertools import count
from pathlib import Path

import pytest

from firmware_runtime.board import registry
from firmware_runtime.executive.clocks import WorldClock
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.wire_clock import REPETITIONS, MeasuredWire
from firmware_runtime.host.doctor import measuring
from firmware_runtime.host.doctor.measuring import Wire, wire_of, wires_of
from firmware_runtime.runs.measured_wires import (
    clock_warnings,
    differs,
    keep_measured,
    measured_wires,
)
from firmware_runtime.statistics.paths import Companion, default_path
from firmware_runtime.system.kernel_files import SystemFiles
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.rigs.board_rig import rig_for
from tests.support.command import Command
from tests.support.fake_machines import lay_out
from tests.support.written_run import WrittenRun


@pytest.fixture(autouse=True)
def own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path))


def timed(board: str, *actual: str) -> Wire:
    """The wire of a board as shipped, on doubles of one with other settings."""
    now = WorldClock()
    bus = rig_for(registry.load(board, actual), now).buses["i2c1"]
    return wire_of(registry.load(board), "i2c1", bus, now)


@pytest.mark.parametrize("actual_hz", [62_500, 100_000, 250_000, 400_000, 650_000, 1_000_000])
def test_the_clock_of_a_wire_is_found_whatever_is_stated(actual_hz: int) -> None:
    now = WorldClock()
    rig = rig_for(registry.load("tachobot"), WorldClock())
    bus = I2cBusDouble("i2c1", now, rig.buses["i2c1"].targets, bus_hz=actual_hz, reach=now.reach)
    wire = wire_of(registry.load("tachobot"), "i2c1", bus, now)
    assert wire.measured is not None
    assert wire.measured.speed_hz == pytest.approx(actual_hz, rel=1e-3)
    assert wire.stated_hz == 400_000


def test_what_an_adapter_takes_beside_the_bits_drops_out_and_is_said() -> None:
    wire = timed("tachobot", "buses.i2c1.overhead_us=150")
    assert wire.measured is not None
    assert wire.measured.speed_hz == pytest.approx(400_000, rel=1e-3)
    assert wire.measured.overhead_us == pytest.approx(150, abs=1)


def test_a_chip_that_may_stretch_the_clock_is_no_measure() -> None:
    assert timed("detective").said == "reading PCA9685 0x40"


def test_nothing_but_a_registers_number_is_written() -> None:
    now = WorldClock()
    bus = rig_for(registry.load("tachobot"), now).buses["i2c1"]
    wire_of(registry.load("tachobot"), "i2c1", bus, now)
    messages = [message for each in bus.log for message in each.messages]
    assert {len(each) for each in messages if isinstance(each, bytes)} == {1}


class StandingStill(I2cBus):
    """Answers without taking time, as no wire does."""

    name = "i2c1"

    def __init__(self, inner: I2cBus) -> None:
        self._inner = inner

    def transaction(self, address: int, messages: object) -> bytes:
        return self._inner.transaction(address, messages)  # type: ignore[arg-type]


def test_what_takes_no_time_has_no_clock() -> None:
    bus = rig_for(registry.load("tachobot"), WorldClock()).buses["i2c1"]
    wire = wire_of(registry.load("tachobot"), "i2c1", StandingStill(bus), lambda: 0)
    assert wire.measured is None
    assert "faster than a wire can be" in wire.said
    assert wire.sentence.startswith("i2c1: not measured, 400000 Hz stated: ")


def test_two_measurements_that_differ_are_none() -> None:
    now, calls = WorldClock(), count()
    bus = rig_for(registry.load("tachobot"), now).buses["i2c1"]

    def slower_later() -> int:
        return now() * (4 + next(calls) // (4 * REPETITIONS))

    wire = wire_of(registry.load("tachobot"), "i2c1", bus, slower_later)
    assert wire.measured is None
    assert "two measurements gave 100000 and 80000 Hz" in wire.said


def test_a_virtual_machine_has_no_wire_to_time(tmp_path: Path) -> None:
    files = lay_out(tmp_path / "vm", {"/sys/hypervisor/type": "xen\n"})
    (wire,) = wires_of(registry.load("tachobot"), doubles=False, files=files)
    assert (wire.measured, wire.said) == (None, "a virtual machine has no wire to time")


def test_a_bus_that_is_not_there_is_not_measured(tmp_path: Path) -> None:
    absent = registry.load("tachobot", ["buses.i2c1.device='/dev/i2c-4711'"])
    (wire,) = wires_of(absent, doubles=False, files=SystemFiles(tmp_path))
    assert wire.measured is None
    assert wire.said.startswith("/dev/i2c-4711 does not exist")


@pytest.mark.slow
def test_check_warns_of_a_wire_that_runs_at_another_clock(command: Command) -> None:
    keep_measured("tachobot", {"/dev/i2c-1": MeasuredWire(399_361, 42.0)})
    assert "was measured" not in command("check", "tachobot").out
    keep_measured("tachobot", {"/dev/i2c-1": MeasuredWire(250_000, 42.0)})
    assert "the wire was measured at 250000 Hz" in command("check", "tachobot").out
    stated = "buses.i2c1.speed_hz=250000"
    assert "was measured" not in command("check", "tachobot", "--set", stated).out


@pytest.mark.parametrize(
    ("speed_hz", "is_another"),
    [(399_361, False), (385_000, False), (415_000, False), (375_000, True), (425_000, True)],
)
def test_a_wire_that_differs_by_more_than_a_divider_does_has_another_clock(
    speed_hz: int, *, is_another: bool
) -> None:
    assert differs(MeasuredWire(speed_hz, 42.0), 400_000) is is_another


def test_what_was_measured_in_another_boot_or_is_damaged_counts_for_nothing() -> None:
    keep_measured("tachobot", {"/dev/i2c-1": MeasuredWire(250_000, 42.0)})
    path = Companion.MEASURED.beside(default_path("tachobot"))
    note = json.loads(path.read_text())
    path.write_text(json.dumps({**note, "boot_id": "another"}))
    assert measured_wires("tachobot") == {}
    path.write_text("{")
    assert list(clock_warnings(registry.load("tachobot"))) == []


@pytest.mark.parametrize("words", [["--measure"], ["tachobot", "--doubles"], ["--doubles"]])
def test_measuring_wants_a_board(command: Command, words: list[str]) -> None:
    ended = command("doctor", *words)
    assert ended.status == 2
    assert "expected --measure and BOARD" in ended.error


def test_measuring_beside_a_run_is_refused(command: Command, tmp_path: Path) -> None:
    WrittenRun(path=tmp_path / "detective.stats", board="detective")
    ended = command("doctor", "tachobot", "--measure", "--doubles")
    assert (ended.status, ended.out) == (2, "")
    assert f"process {os.getpid()} runs detective; end that run first" in ended.error


@pytest.mark.slow
def test_a_wire_too_slow_for_its_board_is_said_with_its_clock(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    slow = MeasuredWire(62_500, 40.0)
    wire = Wire("i2c1", "/dev/i2c-1", 400_000, slow, "reading MPU-9250 0x68")
    monkeypatch.setattr(measuring, "wires_of", lambda *_board, **_where: [wire])
    ended = command("doctor", "tachobot", "--measure")
    assert ended.status == 7
    assert "i2c1: 62500 Hz measured, 400000 Hz stated; 40 us a transaction" in ended.out
    assert "expected buses.i2c1.speed_hz = 62500 in board.toml" in ended.out
    assert "not predicted: " in ended.out
    assert "above 80 % is refused" in ended.out
    assert measured_wires("tachobot") == {"/dev/i2c-1": slow}


@pytest.mark.slow
@pytest.mark.real_time
def test_the_command_measures_doubles_and_keeps_nothing(command: Command, tmp_path: Path) -> None:
    board = tmp_path / "quick.toml"
    text = registry.load("tachobot").source.read_text()
    board.write_text(
        text.replace("period_s = 0.01\n", "period_s = 0.004\n", 1).replace(
            "sample_hz = 200", "sample_hz = 500"
        )
    )
    ended = command("doctor", str(board), "--measure", "--doubles", "--json")
    report = json.loads(ended.out)
    assert ended.status in {0, 7}  # as busy as the machine is
    assert report["wires"][0]["measured"]["speed_hz"] == pytest.approx(400_000, rel=1e-3)
    assert report["period"]["prediction"]["period_ns"] == 4_000_000
    assert report["period"]["shortest_ns"] > 0
    assert measured_wires("tachobot") == {}
