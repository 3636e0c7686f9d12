import math
from typing import TypeAlias

import pytest
from firmware_drivers.chips.srf08 import INTERVAL_NS, Srf08, Srf08Settings
from firmware_drivers.chips.step import duration_ns
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady, WrongDevice

Wire: TypeAlias = list[tuple[int, tuple[Message, ...]]]
Registers: TypeAlias = dict[int, bytearray]
SONAR = 0x73


@pytest.fixture
def registers() -> Registers:
    return {SONAR: bytearray((10,)) + bytearray(255)}


@pytest.fixture
def chip(register_bus: I2cBus) -> Srf08:
    return Srf08(register_bus, SONAR, Srf08Settings(max_range_m=6.0, gain=12))


def show_echo(registers: Registers, centimetres: int, *, revision: int = 10) -> None:
    registers[SONAR][0:4] = bytes((revision, 0x80, *centimetres.to_bytes(2, "big")))


# Settings -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("max_range_m", "register", "ranging_ms"),
    [(11.008, 255, 64), (6.02, 139, 35), (6.0, 139, 35), (0.043, 0, 0.25), (0.044, 1, 0.5)],
)
def test_the_range_register_and_the_time_follow_from_the_range(
    register_bus: I2cBus, max_range_m: float, register: int, ranging_ms: float
) -> None:
    settings = Srf08Settings(max_range_m=max_range_m)
    assert settings.range_register() == register
    chip = Srf08(register_bus, SONAR, settings)
    assert ranging_ms * 1e6 < chip.ranging_ns <= ranging_ms * 1e6 + 1e6


@given(st.floats(0.0001, 11.008))
def test_the_range_reached_is_at_least_the_one_asked_and_43_mm_more_at_most(asked: float) -> None:
    register = Srf08Settings(max_range_m=asked).range_register()
    assert 0 <= register <= 255
    assert -1e-6 < (register + 1) * 0.043 - asked < 0.043


@pytest.mark.parametrize(
    ("settings", "fault"),
    [
        (Srf08Settings(max_range_m=0.0), "max_range_m: 0.0, expected more than 0, 11.008 at most"),
        (Srf08Settings(max_range_m=11.1), "max_range_m: 11.1"),
        (Srf08Settings(max_range_m=math.nan), "max_range_m: nan"),
        (Srf08Settings(gain=32), "gain: 32, expected 0 to 31"),
        (Srf08Settings(gain=-1), "gain: -1"),
    ],
)
def test_a_setting_the_chip_cannot_have_is_refused(
    register_bus: I2cBus, wire: Wire, settings: Srf08Settings, fault: str
) -> None:
    with pytest.raises(SettingError, match=f"SRF08 at 0x73 on i2c-1: {fault}"):
        Srf08(register_bus, SONAR, settings)
    assert wire == []


def test_all_faults_are_reported_at_once(register_bus: I2cBus) -> None:
    with pytest.raises(SettingError, match=r"address: 0x40, .*max_range_m: 20, .*gain: 99"):
        Srf08(register_bus, 0x40, Srf08Settings(max_range_m=20, gain=99))


# Bring-up -----------------------------------------------------------------------------------------


def test_bring_up_waits_out_a_former_ranging_before_it_speaks(chip: Srf08, wire: Wire) -> None:
    wait, *proof = chip.bring_up()
    wait.action()
    assert wire == []
    assert wait.wait_ns > 64_000_000
    proof[0].action()
    assert wire == [
        (SONAR, (b"\x00", 1)),
        *((SONAR, (sent,)) for sent in (b"\x01\x0c", b"\x02\xff", b"\x00\x51")),
    ]
    assert 64_000_000 < duration_ns(proof) <= 80_000_000


@pytest.mark.parametrize("revision", [0x00, 0xFF])
def test_a_revision_that_is_none_is_another_device(
    chip: Srf08, registers: Registers, revision: int
) -> None:
    registers[SONAR][0] = revision
    with pytest.raises(WrongDevice, match=rf"reads {revision:02x}, expected 01 to fe"):
        chip.identify()


def test_an_absent_chip_says_what_was_expected(chip: Srf08, registers: Registers) -> None:
    registers.clear()
    with pytest.raises(NoAcknowledge, match="SRF08 at 0x73 on i2c-1: no answer; expected a soft"):
        chip.identify()


# Ranging ------------------------------------------------------------------------------------------


def test_every_ranging_brings_gain_and_range_with_it(chip: Srf08, wire: Wire) -> None:
    chip.start_ranging()
    assert wire == [(SONAR, (sent,)) for sent in (b"\x01\x0c", b"\x02\x8b", b"\x00\x51")]


@pytest.mark.parametrize(("centimetres", "metres"), [(1, 0.01), (256, 2.56), (602, 6.02)])
def test_an_echo_is_given_in_metres(
    chip: Srf08, registers: Registers, wire: Wire, centimetres: int, metres: float
) -> None:
    chip.start_ranging()
    show_echo(registers, centimetres)
    assert chip.read_distance() == metres
    assert wire[-1] == (SONAR, (b"\x00", 4))


def test_no_echo_is_infinitely_far_and_not_zero(chip: Srf08, registers: Registers) -> None:
    chip.start_ranging()
    show_echo(registers, 0)
    assert chip.read_distance() == math.inf


def test_an_echo_is_given_once(chip: Srf08, registers: Registers, wire: Wire) -> None:
    chip.start_ranging()
    show_echo(registers, 100)
    chip.read_distance()
    wire.clear()
    with pytest.raises(NotReady, match="no ranging to read"):
        chip.read_distance()
    assert wire == []


def test_nothing_is_read_before_a_ranging(chip: Srf08, wire: Wire) -> None:
    with pytest.raises(NotReady, match="no ranging to read"):
        chip.read_distance()
    assert wire == []


def test_silence_while_ranging_is_not_ready_and_the_echo_can_still_be_read(
    chip: Srf08, registers: Registers
) -> None:
    chip.start_ranging()
    memory = registers.pop(SONAR)
    with pytest.raises(NotReady, match="expected the echo 36 ms after the ping"):
        chip.read_distance()
    registers[SONAR] = memory
    show_echo(registers, 100)
    assert chip.read_distance() == 1.0


@pytest.mark.parametrize(
    ("centimetres", "revision", "read"),
    [
        (100, 0xFF, "ff 80 00 64"),
        (0xFFFF, 0xFF, "ff 80 ff ff"),
        (100, 0x00, "00 80 00 64"),
        (1102, 10, "0a 80 04 4e"),
    ],
)
def test_bytes_that_cannot_be_an_echo_are_not_made_one(
    chip: Srf08, registers: Registers, centimetres: int, revision: int, read: str
) -> None:
    chip.start_ranging()
    show_echo(registers, centimetres, revision=revision)
    with pytest.raises(NotReady, match=f"registers 0 to 3 read {read}; expected"):
        chip.read_distance()


def test_a_line_that_is_held_is_not_an_echo_from_nowhere(chip: Srf08, registers: Registers) -> None:
    chip.start_ranging()
    registers[SONAR][0:4] = bytes(4)
    with pytest.raises(NotReady, match="registers 0 to 3 read 00 00 00 00; expected"):
        chip.read_distance()


def test_a_ranging_that_could_not_be_started_gives_no_echo(
    chip: Srf08, registers: Registers
) -> None:
    chip.start_ranging()
    memory = registers.pop(SONAR)
    with pytest.raises(NoAcknowledge, match="no answer to a ranging command"):
        chip.start_ranging()
    registers[SONAR] = memory
    show_echo(registers, 100)
    with pytest.raises(NotReady, match="no ranging to read"):
        chip.read_distance()


def test_pings_keep_65_ms_apart_however_short_the_range(register_bus: I2cBus) -> None:
    chip = Srf08(register_bus, SONAR, Srf08Settings(max_range_m=1.0))
    assert chip.interval_ns == INTERVAL_NS == 65_000_000
