import math
from typing import TypeAlias

import pytest
from firmware_drivers.chips.pca9685 import Pca9685, software_reset
from firmware_drivers.chips.pca9685_registers import actual_frequency_hz, duty_burst, prescale_for
from firmware_drivers.chips.step import duration_ns
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.budget import bits, wire_bytes
from firmware_runtime.hal.i2c import I2cBus, Message
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady, WrongDevice

Wire: TypeAlias = list[tuple[int, tuple[Message, ...]]]


@pytest.fixture
def registers() -> dict[int, bytearray]:
    power_up = bytearray(256)
    power_up[0x00:0x06] = bytes((0x11, 0x04, 0xE2, 0xE4, 0xE8, 0xE0))
    power_up[0x09] = 0x10
    power_up[0xFE] = 0x1E
    return {0x40: power_up, 0x00: bytearray(256)}


@pytest.fixture
def running(register_bus: I2cBus, wire: Wire) -> Pca9685:
    chip = Pca9685(register_bus)
    for step in chip.bring_up(1000):
        step.action()
    wire.clear()
    return chip


# Rates --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("frequency_hz", "prescale", "actual_hz"),
    [
        (1526, 3, 1525.88),
        (1000, 5, 1017.25),
        (400, 14, 406.90),
        (200, 30, 196.89),
        (100, 60, 100.06),
        (50, 121, 50.03),
        (24, 253, 24.03),
    ],
)
def test_prescale_is_the_rounded_one(frequency_hz: float, prescale: int, actual_hz: float) -> None:
    assert prescale_for(frequency_hz) == prescale
    assert actual_frequency_hz(prescale) == pytest.approx(actual_hz, abs=0.005)


def test_a_calibrated_oscillator_changes_the_prescale_and_the_true_rate() -> None:
    assert prescale_for(50, 26.2e6) == 127
    assert actual_frequency_hz(127, 26.2e6) == pytest.approx(49.97, abs=0.005)


@pytest.mark.parametrize("frequency_hz", [23.9, 1527, 0, -50, math.inf, math.nan])
def test_a_rate_the_chip_cannot_have_is_refused(frequency_hz: float) -> None:
    with pytest.raises(SettingError, match=r"PCA9685 frequency: .* Hz; expected 24 to 1526 Hz"):
        prescale_for(frequency_hz)


def test_a_rate_out_of_this_oscillators_reach_is_refused_with_its_reach() -> None:
    with pytest.raises(SettingError, match=r"24 Hz; expected 25\.\d to 1\d+\.\d Hz"):
        prescale_for(24, 27e6)


@pytest.mark.parametrize("osc_hz", [25, 0.0, math.nan, 50e6])
def test_an_implausible_oscillator_is_refused(osc_hz: float) -> None:
    with pytest.raises(SettingError, match="expected 20e6 to 30e6"):
        prescale_for(50, osc_hz)


@given(st.floats(24.1, 1525), st.floats(24.9e6, 25.1e6))
def test_no_other_prescale_divides_the_oscillator_closer(
    frequency_hz: float, osc_hz: float
) -> None:
    prescale = prescale_for(frequency_hz, osc_hz)
    wanted = osc_hz / (4096 * frequency_hz)
    assert abs(prescale + 1 - wanted) <= 0.5 + 1e-9


# Bring-up -----------------------------------------------------------------------------------------


def test_bring_up_stops_the_outputs_and_leaves_allcall_before_anything_else(
    register_bus: I2cBus, wire: Wire
) -> None:
    wait, silence, *_ = Pca9685(register_bus).bring_up(1000)
    wait.action()
    assert wire == []
    silence.action()
    assert wire == [(0x40, (each,)) for each in (b"\x01\x04", b"\xfd\x10", b"\x00\x20")]
    assert silence.wait_ns > 1e9 / 23.84


def test_bring_up_sets_the_rate_asleep_and_wakes_by_half_a_millisecond(
    register_bus: I2cBus, wire: Wire
) -> None:
    chip = Pca9685(register_bus)
    steps = chip.bring_up(50)
    for step in steps:
        step.action()
    writes = [sent[0] for _, sent in wire[3:] if len(sent) == 1]
    assert writes == [b"\x00\x30", b"\xfe\x79", b"\x00\x20"]
    assert {step.name: step.wait_ns for step in steps}["wake"] == 500_000
    assert duration_ns(steps) < 50_000_000
    assert chip.frequency_hz == pytest.approx(50.03, abs=0.005)


def test_an_impossible_rate_is_refused_before_anything_is_sent(
    register_bus: I2cBus, wire: Wire
) -> None:
    with pytest.raises(SettingError):
        Pca9685(register_bus).bring_up(1600)
    assert wire == []


def test_an_absent_chip_says_what_was_expected(
    register_bus: I2cBus, registers: dict[int, bytearray]
) -> None:
    del registers[0x40]
    with pytest.raises(NoAcknowledge, match="PCA9685 at 0x40 on i2c-1: no answer; expected a PCA"):
        Pca9685(register_bus).silence()


def test_another_device_at_the_address_is_found_by_its_registers(
    register_bus: I2cBus, registers: dict[int, bytearray]
) -> None:
    chip = Pca9685(register_bus)
    chip.silence()
    registers[0x40][0x02] = 0xE3
    expected = r"PCA9685 at 0x40 on i2c-1: .* read 20 04 e3 e4 e8 e0, expected .*another device"
    with pytest.raises(WrongDevice, match=expected):
        chip.identify()


@pytest.mark.parametrize("silent", [0x00, 0xFF])
def test_a_bus_that_reads_one_level_only_is_no_pca9685(
    register_bus: I2cBus, registers: dict[int, bytearray], silent: int
) -> None:
    registers[0x40][:] = bytes((silent,)) * 256
    with pytest.raises(WrongDevice):
        Pca9685(register_bus).identify()


def test_a_latched_external_clock_is_named_with_its_cure(
    register_bus: I2cBus, registers: dict[int, bytearray]
) -> None:
    chip = Pca9685(register_bus)
    chip.silence()
    registers[0x40][0x00] |= 0x40
    with pytest.raises(
        NotReady, match=r"EXTCLK is latched .* power off and on, or send a software"
    ):
        chip.identify()


def test_verify_says_what_was_found_and_expected(
    running: Pca9685, registers: dict[int, bytearray]
) -> None:
    running.verify()
    registers[0x40][0x00] = 0x11
    with pytest.raises(NotReady, match="read 11 04 05, expected 20 04 05; it was reset"):
        running.verify()
    with pytest.raises(NotReady, match="duties before bring-up"):
        running.set_duties(0, (0.5,))


def test_software_reset_is_the_general_call_with_one_byte(register_bus: I2cBus, wire: Wire) -> None:
    software_reset(register_bus)
    assert wire == [(0x00, (b"\x06",))]


# Outputs ------------------------------------------------------------------------------------------


def test_eight_duties_are_one_burst_of_34_bytes(running: Pca9685, wire: Wire) -> None:
    running.set_duties(4, [0.5] * 8)
    ((address, messages),) = wire
    assert address == 0x40
    assert messages == (bytes((0x06 + 4 * 4, *(0x00, 0x00, 0x00, 0x08) * 8)),)
    assert wire_bytes(messages) == 34
    assert bits(messages) == bits(duty_burst(8)) == 308


@pytest.mark.parametrize(
    ("duty", "registers_written", "written"),
    [
        (0.0, b"\x00\x00\x00\x10", 0.0),
        (1.0, b"\x00\x10\x00\x00", 1.0),
        (0.5, b"\x00\x00\x00\x08", 0.5),
        (0.1, b"\x00\x00\x9a\x01", 410 / 4096),
        (1 / 4096, b"\x00\x00\x01\x00", 1 / 4096),
        (1e-5, b"\x00\x00\x00\x10", 0.0),
        (4095 / 4096, b"\x00\x00\xff\x0f", 4095 / 4096),
        (0.99999, b"\x00\x10\x00\x00", 1.0),
        (-0.0, b"\x00\x00\x00\x10", 0.0),
    ],
)
def test_a_duty_is_rounded_to_4096ths_and_its_ends_are_full(
    running: Pca9685, wire: Wire, duty: float, registers_written: bytes, written: float
) -> None:
    assert running.set_duties(0, (duty,)) == (written,)
    assert wire == [(0x40, (b"\x06" + registers_written,))]


def test_staggered_channels_start_a_sixteenth_apart_with_the_same_duty(
    register_bus: I2cBus, wire: Wire
) -> None:
    chip = Pca9685(register_bus, staggered=True)
    for step in chip.bring_up(1000):
        step.action()
    assert chip.set_duties(14, (0.25, 0.25)) == (0.25, 0.25)
    # channel 14: on 0xE00, off 0x1200 - 0x1000; channel 15: on 0xF00, off 0x300
    assert wire[-1] == (0x40, (b"\x3e\x00\x0e\x00\x02\x00\x0f\x00\x03",))


@pytest.mark.parametrize("duty", [-0.001, 1.001, math.nan, math.inf])
def test_a_duty_that_is_none_is_refused_and_nothing_is_sent(
    running: Pca9685, wire: Wire, duty: float
) -> None:
    with pytest.raises(
        ValueError, match=r"PCA9685 at 0x40 on i2c-1: a duty of .*, expected 0 to 1"
    ):
        running.set_duties(0, (0.5, duty))
    assert wire == []


@pytest.mark.parametrize(("first", "count"), [(-1, 1), (15, 2), (16, 1), (0, 17), (3, 0)])
def test_channels_that_are_not_there_are_refused(
    running: Pca9685, wire: Wire, first: int, count: int
) -> None:
    with pytest.raises(ValueError, match=rf"{count} duties from channel {first}, expected them"):
        running.set_duties(first, [0.5] * count)
    assert wire == []


def test_duties_before_bring_up_are_refused(register_bus: I2cBus, wire: Wire) -> None:
    with pytest.raises(NotReady, match="duties before bring-up"):
        Pca9685(register_bus).set_duties(0, (0.5,))
    assert wire == []


def test_stop_all_is_six_bytes_in_any_state(register_bus: I2cBus, wire: Wire) -> None:
    Pca9685(register_bus).stop_all()
    assert wire == [(0x40, (b"\x01\x04",)), (0x40, (b"\xfd\x10",))]
    assert [wire_bytes(sent) for _, sent in wire] == [3, 3]
