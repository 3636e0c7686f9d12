"""`firmware-runtime try CHIP`: permission to move, lines taken by a run, signals, exit statuses."""

import io
import json
import math
import os
import signal
import sys
from contextlib import closing
from pathlib import Path

import pytest
from firmware_drivers.catalogue.trial import Quantity
from firmware_drivers.chips.maxbotix import FAMILIES
from firmware_drivers.commands import single, try_chip, trying
from firmware_drivers.commands.readings import Readings

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.i2c import I2cBus
from firmware_runtime.hal.serial import SerialPort
from firmware_runtime.hal.wire_errors import BusAbsent, BusInUse
from firmware_runtime.system.signals import UntilSignal
from sim_doubles.chip_doubles import chip_double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.serial_line import SerialLineDouble
from tests.support.command import Command, started

MOVE = ("try", "pca9685", "--channel", "3", "--duty", "0.5", "--for", "0.05")
PATIENCE_S = 60


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def chip(monkeypatch: pytest.MonkeyPatch) -> Pca9685Double:
    """A PCA9685 on /dev/i2c-1, whose outputs can be looked at."""
    double = Pca9685Double(lambda: 0, 0x40)
    bus = I2cBusDouble("i2c", lambda: 0, [double])

    def open_i2c(_name: str, device: str, *, alone: bool) -> I2cBus:
        assert (device, alone) == ("/dev/i2c-1", True)
        return bus

    monkeypatch.setattr(single, "open_i2c", open_i2c)
    monkeypatch.setattr(double, "bus", bus, raising=False)
    return double


def test_a_sensors_double_is_read_without_any_hardware(command: Command) -> None:
    ended = command("try", "cmps12", "--doubles", "--for", "0.2", "--every", "0.1")
    assert ended.status == 0
    first, *_ = ended.out.splitlines()
    assert first.startswith("0.00 s  bearing ")
    assert first.endswith("calibration 3 of 3")


@pytest.mark.parametrize(("name", "key"), [("srf08", "distance_m"), ("ak8963", "field_t")])
def test_json_is_a_line_a_reading_in_si_units(command: Command, name: str, key: str) -> None:
    ended = command("try", name, "--doubles", "--for", "0.1", "--json")
    assert set(json.loads(ended.out.splitlines()[0])) == {"t_s", key}


@pytest.mark.parametrize("name", ["cmps12", "maxbotix"])
def test_readings_are_as_far_apart_as_asked_for_by_the_clock_of_the_chip(
    command: Command, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    clock = ManualClock()

    class WakesEarly(UntilSignal):
        def wait(self, timeout_s: float | None = None) -> bool:
            assert timeout_s is not None
            clock.advance(math.ceil(timeout_s * SECOND / 2))
            return False

    bus = I2cBusDouble("i2c", clock, chip_double("cmps12").on_bus(clock, 0x60))
    port = SerialLineDouble("ttyS0", clock, chip_double("maxbotix").on_port(clock))
    monkeypatch.setattr(single, "open_i2c", lambda *_, **_alone: bus)
    monkeypatch.setattr(single, "open_serial", lambda *_: port)
    monkeypatch.setattr(single, "monotonic_ns", clock)
    monkeypatch.setattr(try_chip, "until_signal", lambda: closing(WakesEarly()))
    shown = command.said("try", name, "--for", "1", "--every", "0.25", "--json")
    times = [json.loads(line)["t_s"] for line in shown.splitlines()]
    since = [each - times[0] for each in times]
    assert since == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0], abs=1e-6)


@pytest.mark.parametrize(
    ("said", "device"),
    [
        (("maxbotix",), "/dev/serial0"),
        (("maxbotix", "--port", "/dev/ttyUSB7"), "/dev/ttyUSB7"),
        (("sabertooth", "--left", "0.1", "--yes"), "/dev/serial0"),
    ],
)
def test_a_chip_on_a_serial_port_is_sought_there_at_its_rate(
    command: Command, monkeypatch: pytest.MonkeyPatch, said: tuple[str, ...], device: str
) -> None:
    def open_serial(name: str, path: str, baud: int) -> SerialPort:
        raise BusAbsent(f"{name} is {path} at {baud} baud")

    monkeypatch.setattr(single, "open_serial", open_serial)
    sentence = command.refused("try", *said, "--for", "1", status=3)
    assert f"{Path(device).name} is {device} at 9600 baud" in sentence


def test_nothing_moves_without_a_terminal_that_could_be_asked(
    command: Command, chip: Pca9685Double, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("y\n"))
    assert "expected --yes" in command.refused(*MOVE)
    assert not chip.bus.log  # type: ignore[attr-defined]


def test_nothing_moves_where_there_is_no_standard_input(
    command: Command, chip: Pca9685Double, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", None)
    assert command(*MOVE).status == 2
    assert not chip.bus.log  # type: ignore[attr-defined]


@pytest.mark.parametrize(("answer", "status"), [("y\n", 0), ("n\n", 5), ("\n", 5), ("", 5)])
def test_what_moves_is_asked_first_at_a_terminal(
    command: Command,
    chip: Pca9685Double,
    monkeypatch: pytest.MonkeyPatch,
    answer: str,
    status: int,
) -> None:
    monkeypatch.setattr(sys, "stdin", Terminal(answer))
    ended = command(*MOVE)
    assert ended.status == status
    assert "channel 3 goes to duty 0.5 at 1017 Hz, its other 15 go off, for 0.05 s" in ended.error
    assert "kill -9" in ended.error
    assert bool(chip.bus.log) is (status == 0)  # type: ignore[attr-defined]
    assert not any(chip.duties)


def test_what_moves_for_no_stated_time_is_off_after_a_while(
    command: Command, chip: Pca9685Double, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(try_chip, "DRIVEN_S", 0.01)
    assert command.said(*MOVE[:-2], "--yes").endswith(": off\n")
    assert chip.all_off


def test_it_was_on_in_between(
    command: Command, chip: Pca9685Double, monkeypatch: pytest.MonkeyPatch
) -> None:
    before: list[tuple[float, ...]] = []
    monkeypatch.setattr(chip, "before_change", lambda: before.append(chip.duties))
    ended = command(*MOVE, "--yes")
    assert (ended.status, ended.error.count("channel 3 goes to duty 0.5")) == (0, 1)
    assert ended.out.endswith(": off\n")
    assert any(duties[3] == 0.5 for duties in before)
    assert not any(chip.duties)


def test_a_bus_that_a_run_drives_is_left_alone(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def in_use(_name: str, _device: str, *, alone: bool) -> I2cBus:
        assert alone
        raise BusInUse("driven by another process")

    monkeypatch.setattr(single, "open_i2c", in_use)
    for words in (MOVE, ("try", "mpu9250", "--for", "1")):
        assert "driven by another process" in command.refused(*words, status=3)


def test_what_stays_on_is_said_and_ends_with_4(
    command: Command, chip: Pca9685Double, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trying, "KEEP_SWITCHING_OFF", 50 * MILLISECOND)
    move = chip.start

    def dies_once_it_is_on(address: int, *, read: bool) -> bool:
        return not any(chip.duties) and move(address, read=read)

    monkeypatch.setattr(chip, "start", dies_once_it_is_on)
    ended = command(*MOVE, "--yes")
    assert ended.status == 4
    assert "not made safe: i2c 0x40" in ended.error


def test_an_error_while_it_moves_switches_off_and_is_named(
    command: Command, chip: Pca9685Double, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr(Readings, "show", fails)
    assert "execute: MemoryError" in command.refused(*MOVE, "--yes")
    assert chip.bus.log  # type: ignore[attr-defined]
    assert not any(chip.duties)


def test_a_chip_that_is_not_there_is_one_sentence(command: Command, chip: Pca9685Double) -> None:
    chip.bus.faults = FaultScript([NackAddress(address=0x40, times=None)])  # type: ignore[attr-defined]
    assert "no answer; expected a PCA9685; `firmware-runtime probe` shows" in command.refused(
        *MOVE, "--yes", status=3
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "status"),
    [
        (signal.SIGINT, 130),
        (signal.SIGTERM, 143),
        (signal.SIGHUP, 143),
        (signal.SIGQUIT, 143),
        (signal.SIGTSTP, 143),
    ],
)
def test_a_signal_switches_off_before_it_ends_a_trial(number: signal.Signals, status: int) -> None:
    words = ("try", "pca9685", "--doubles", "--channel", "0", "--duty", "0.5", "--for", "60")
    with started(*words) as trial:
        assert trial.stdout is not None
        assert "duty 0.5" in trial.stdout.readline()
        trial.send_signal(number)
        assert trial.stdout.readline().endswith(": off\n")
        assert trial.wait(PATIENCE_S) == status


@pytest.mark.slow
def test_a_reader_that_goes_ends_watching() -> None:
    words = ("try", "cmps12", "--doubles", "--every", "0.05")
    with started(*words) as trial:
        assert trial.stdout is not None
        trial.stdout.readline()
        trial.stdout.close()
        assert trial.wait(PATIENCE_S) == 0


def test_a_full_pipe_does_not_hold_up_what_moves() -> None:
    inlet, outlet = os.pipe()
    os.set_blocking(outlet, False)
    try:
        while True:
            os.write(outlet, bytes(4096))
    except BlockingIOError:
        os.set_blocking(outlet, True)
    with os.fdopen(inlet), os.fdopen(outlet, "w") as full:
        readings = Readings(full, as_json=False, never_waits=True)
        readings.show(0, (Quantity("duty", 0.5, "duty", ""),))


def test_what_moves_is_shown_where_it_changes() -> None:
    inlet, outlet = os.pipe()
    with os.fdopen(inlet) as shown, os.fdopen(outlet, "w") as pipe:
        readings = Readings(pipe, as_json=False, never_waits=True)
        for duty in (0.5, 0.5, 0.7):
            readings.show(0, (Quantity("duty", duty, "duty", ""),))
        pipe.close()
        assert shown.read().split() == ["0.00", "s", "duty", "0.50", "0.00", "s", "duty", "0.70"]


def test_at_a_terminal_each_reading_takes_the_place_of_the_one_before() -> None:
    terminal = Terminal()
    readings = Readings(terminal, as_json=False, never_waits=False)
    for distance_m in (1.0, float("inf")):
        readings.show(0, (Quantity("distance_m", distance_m, "distance", "m"),))
    readings.end()
    shown = terminal.getvalue()
    assert shown.count("\x1b[2A") == 1
    assert shown.count("\n") == 4
    assert "distance inf m" in shown


def test_a_default_is_shown_as_a_person_writes_it(command: Command) -> None:
    shown = command("try", "pca9685", "--help").out
    assert "default 25000000" in shown
    assert ".0" not in shown


def test_what_may_be_chosen_is_listed(command: Command) -> None:
    shown = command.said("try", "maxbotix", "--help")
    assert all(family in shown for family in FAMILIES)


def test_no_echo_is_null_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    readings = Readings(sys.stdout, as_json=True, never_waits=False)
    readings.show(0, (Quantity("distance_m", float("inf"), "distance", "m"),))
    assert json.loads(capsys.readouterr().out)["distance_m"] is None
