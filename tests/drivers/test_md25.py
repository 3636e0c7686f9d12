import math
import struct
from typing import TypeAlias

import pytest
from firmware_drivers.chips.md25 import Md25, Md25Report, Md25Settings
from firmware_drivers.chips.step import duration_ns

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.budget import bits
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady, WrongDevice

Wire: TypeAlias = list[tuple[int, tuple[Message, ...]]]
Registers: TypeAlias = dict[int, bytearray]
CHIP = 0x58
STOP = b"\x00\x80\x80"


@pytest.fixture
def registers() -> Registers:
    power_up = bytearray(256)
    power_up[0x0D:0x10] = bytes((2, 5, 0))
    return {CHIP: power_up}


@pytest.fixture
def running(register_bus: I2cBus, wire: Wire) -> Md25:
    chip = Md25(register_bus)
    bring_up(chip)
    wire.clear()
    return chip


def bring_up(chip: Md25) -> None:
    for step in chip.bring_up():
        step.action()


def writes(wire: Wire) -> list[bytes]:
    return [sent[0] for _, sent in wire if len(sent) == 1 and isinstance(sent[0], bytes)]


# Bring-up -----------------------------------------------------------------------------------------


def test_bring_up_stops_sets_up_and_leaves_the_timeout_on(register_bus: I2cBus, wire: Wire) -> None:
    chip = Md25(register_bus, settings=Md25Settings(acceleration=10))
    bring_up(chip)
    assert writes(wire) == [
        STOP,
        b"\x0e\x01",
        b"\x0f\x00",
        STOP,
        b"\x0e\x0a",
        b"\x10\x31",
        b"\x10\x33",
    ]
    assert duration_ns(chip.bring_up()) == 0


@pytest.mark.parametrize(
    ("mode", "stop"), [(0, STOP), (1, b"\x00\x00\x00"), (2, STOP), (3, b"\x00\x00\x00")]
)
def test_a_chip_left_in_another_mode_is_stopped_in_that_modes_words(
    register_bus: I2cBus, registers: Registers, wire: Wire, mode: int, stop: bytes
) -> None:
    registers[CHIP][0x0F] = mode
    bring_up(Md25(register_bus))
    assert writes(wire)[0] == stop
    assert registers[CHIP][0x0F] == 0
    assert registers[CHIP][0x00:0x02] == b"\x80\x80"


def test_the_ramp_is_slowest_while_a_stop_may_mean_reverse(
    register_bus: I2cBus, wire: Wire
) -> None:
    bring_up(Md25(register_bus))
    slow, mode, stop = (wire.index((CHIP, (each,))) for each in (b"\x0e\x01", b"\x0f\x00", STOP))
    assert stop < slow < mode
    assert wire[mode + 1] == (CHIP, (STOP,))


@pytest.mark.parametrize(
    "found", [b"\x00\x05\x00", b"\xff\xff\xff", b"\x02\x00\x00", b"\x02\x05\x04"]
)
def test_what_is_no_md25_is_refused_before_anything_is_written(
    register_bus: I2cBus, registers: Registers, wire: Wire, found: bytes
) -> None:
    registers[CHIP][0x0D:0x10] = found
    with pytest.raises(WrongDevice, match=f"registers 13 to 15 read {found.hex(' ')}, expected"):
        bring_up(Md25(register_bus))
    assert writes(wire) == []


def test_an_absent_chip_says_what_was_expected(register_bus: I2cBus, registers: Registers) -> None:
    registers.clear()
    with pytest.raises(NoAcknowledge, match="MD25 at 0x58 on i2c-1: no answer; expected a soft"):
        bring_up(Md25(register_bus))


@pytest.mark.parametrize("acceleration", [0, 11])
def test_an_acceleration_it_cannot_have_is_refused(register_bus: I2cBus, acceleration: int) -> None:
    with pytest.raises(SettingError, match=f"acceleration: {acceleration}, expected 1 to 10"):
        Md25(register_bus, settings=Md25Settings(acceleration=acceleration))


# Speeds -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("left", "right", "sent"),
    [
        (0.0, 0.0, b"\x00\x80\x80"),
        (1.0, -1.0, b"\x00\xff\x01"),
        (-0.5, 0.5, b"\x00\x40\xc0"),
        (0.001, -0.0, b"\x00\x80\x80"),
    ],
)
def test_speeds_are_one_burst_about_128(
    running: Md25, wire: Wire, left: float, right: float, sent: bytes
) -> None:
    running.set_speeds(left, right)
    assert wire == [(CHIP, (b"\x02", 14)), (CHIP, (sent,))]
    assert sum(bits(messages) for _, messages in wire) == 194


def test_opposite_speeds_are_sent_as_opposite_steps(running: Md25, wire: Wire) -> None:
    for hundredths in range(-100, 101):
        speed = hundredths / 100
        running.set_speeds(speed, -speed)
        _, left, right = writes(wire)[-1]
        assert left + right == 2 * 128
        assert abs(left - 128 - 127 * speed) <= 0.5


def test_the_report_is_read_in_the_same_call(running: Md25, registers: Registers) -> None:
    registers[CHIP][0x02:0x0D] = struct.pack(">2i3B", -360, 70_000, 121, 3, 28)
    report = running.set_speeds(0.1, 0.2)
    expected = Md25Report(-360, 70_000, 12.1, 0.3, 2.8)
    assert report == pytest.approx(expected)


@pytest.mark.parametrize("speed", [1.001, -1.001, math.nan, math.inf])
def test_a_speed_that_is_none_is_refused_and_nothing_is_sent(
    running: Md25, wire: Wire, speed: float
) -> None:
    with pytest.raises(ValueError, match=r"speeds .*, expected -1 to 1"):
        running.set_speeds(0.0, speed)
    assert wire == []


def test_speeds_before_bring_up_are_refused(register_bus: I2cBus, wire: Wire) -> None:
    with pytest.raises(NotReady, match="speeds before bring-up"):
        Md25(register_bus).set_speeds(0.0, 0.0)
    assert wire == []


def test_a_chip_that_was_reset_is_reported_and_not_driven_on(
    register_bus: I2cBus, registers: Registers
) -> None:
    chip = Md25(register_bus, settings=Md25Settings(acceleration=10))
    bring_up(chip)
    registers[CHIP][0x0E] = 5
    with pytest.raises(
        NotReady, match="acceleration, mode read 5, 0, expected 10, 0; it was reset"
    ):
        chip.set_speeds(0.5, 0.5)
    with pytest.raises(NotReady, match="speeds before bring-up"):
        chip.set_speeds(0.5, 0.5)


@pytest.mark.parametrize(("mode", "stop"), [(0, STOP), (1, b"\x00\x00\x00"), (3, b"\x00\x00\x00")])
@pytest.mark.parametrize("is_up", [False, True])
def test_stop_asks_for_the_mode_at_any_time(
    running: Md25, registers: Registers, wire: Wire, mode: int, stop: bytes, *, is_up: bool
) -> None:
    """In mode 0, the stop of a signed mode is full reverse; in a signed mode that of mode 0 is."""
    if not is_up:
        running.identify()
        wire.clear()
    registers[CHIP][0x0F] = mode
    running.stop()
    assert wire == [(CHIP, (b"\x0f", 1)), (CHIP, (stop,))]
    assert sum(bits(messages) for _, messages in wire) == 77


@pytest.mark.parametrize(("is_up", "written"), [(False, []), (True, [STOP])])
def test_a_stop_whose_mode_is_not_answered_is_tried_in_the_last_words_and_not_taken_for_done(
    running: Md25,
    register_bus: I2cBus,
    wire: Wire,
    monkeypatch: pytest.MonkeyPatch,
    *,
    is_up: bool,
    written: list[bytes],
) -> None:
    if not is_up:
        running.identify()
        wire.clear()

    def deaf(address: int, data: bytes, length: int) -> bytes:
        raise NoAcknowledge(f"{address:#x} to {data!r}, {length} bytes")

    monkeypatch.setattr(register_bus, "write_read", deaf)
    with pytest.raises(NoAcknowledge):
        running.stop()
    assert writes(wire) == written


def test_a_mode_changed_by_another_program_is_reported_and_stopped_in_its_words(
    running: Md25, registers: Registers, wire: Wire
) -> None:
    registers[CHIP][0x0F] = 1
    with pytest.raises(NotReady, match="read 5, 1, expected 5, 0"):
        running.set_speeds(0.0, 0.0)
    running.stop()
    assert writes(wire)[-1] == b"\x00\x00\x00"


def test_identified_again_it_is_no_longer_ready_until_it_was_verified(
    running: Md25, wire: Wire
) -> None:
    """Its mode may be another by now: a new bring-up begins so."""
    running.identify()
    wire.clear()
    with pytest.raises(NotReady, match="speeds before bring-up"):
        running.set_speeds(0.1, 0.1)
    assert wire == []
    running.verify()
    running.set_speeds(0.1, 0.1)


def test_verify_says_whether_it_may_be_driven(running: Md25, registers: Registers) -> None:
    registers[CHIP][0x0F] = 1
    with pytest.raises(NotReady, match="read 5, 1, expected 5, 0"):
        running.verify()
    with pytest.raises(NotReady, match="speeds before bring-up"):
        running.set_speeds(0.1, 0.1)
