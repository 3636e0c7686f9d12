"""PCA9685 double: reset values, pointer, auto-increment, reserved registers, addresses, resets."""

import pytest

from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

CHANNEL_OFF = b"\x00\x00\x00\x10"
LED_REGISTERS = 0x06


def register(bus: I2cBusDouble, number: int, address: int = 0x40) -> int:
    return bus.write_read(address, bytes([number]), 1)[0]


# Reset values and writable bits


def test_power_up_values_are_those_of_the_data_sheet(bus: I2cBusDouble) -> None:
    values = bytes(register(bus, number) for number in range(0x46))
    assert values == b"\x11\x04\xe2\xe4\xe8\xe0" + CHANNEL_OFF * 16
    assert register(bus, 0xFE) == 0x1E


def test_reserved_bits_read_zero(awake: I2cBusDouble) -> None:
    awake.write(0x40, b"\x01\xff\xff\xff\xff\xff\xff\xff\xff\xff")
    expected = b"\x1f\xfe\xfe\xfe\xfe\xff\x1f\xff\x1f"
    assert awake.write_read(0x40, b"\x01", 9) == expected


# Pointer


def test_without_auto_increment_a_burst_hits_one_register(bus: I2cBusDouble) -> None:
    bus.write(0x40, b"\x06\xff\x7f\x00\x10")
    assert register(bus, 0x06) == 0x10
    assert register(bus, 0x07) == 0x00


def test_burst_may_set_auto_increment_and_go_on(bus: I2cBusDouble) -> None:
    bus.write(0x40, b"\x00\x31\x05\xaa")
    assert bus.write_read(0x40, b"\x00", 3) == b"\x31\x05\xaa"


def test_burst_that_clears_auto_increment_stays_at_mode1(awake: I2cBusDouble) -> None:
    awake.write(0x40, b"\x00\x01\x11")
    assert register(awake, 0x00) == 0x11
    assert register(awake, 0x01) == 0x04


def test_read_without_pointer_goes_on_where_the_last_access_ended(awake: I2cBusDouble) -> None:
    assert awake.write_read(0x40, b"\x02", 1) == b"\xe2"
    assert awake.read(0x40, 2) == b"\xe4\xe8"


def test_pointer_is_zero_after_power_up(bus: I2cBusDouble) -> None:
    assert bus.read(0x40, 2) == b"\x11\x11"


def test_auto_increment_goes_from_the_last_channel_to_mode1(awake: I2cBusDouble) -> None:
    assert awake.write_read(0x40, b"\x44", 4) == b"\x00\x10\x21\x04"


def test_auto_increment_goes_from_all_led_through_pre_scale_to_mode1(awake: I2cBusDouble) -> None:
    assert awake.write_read(0x40, b"\xfa", 6) == b"\x00\x00\x00\x00\x1e\x21"


@pytest.mark.parametrize("reserved", [0x46, 0x80, 0xF9])
def test_reserved_register_is_not_acknowledged_and_leaves_the_pointer(
    awake: I2cBusDouble, pca: Pca9685Double, reserved: int
) -> None:
    awake.write(0x40, b"\x03")
    with pytest.raises(NoAcknowledge):
        awake.write(0x40, bytes([reserved, 0x55]))
    assert awake.read(0x40, 1) == b"\xe4"
    assert "reserved register" in pca.warnings[0]


def test_all_led_registers_copy_into_every_channel_and_read_zero(awake: I2cBusDouble) -> None:
    awake.write(0x40, b"\xfa\x01\x02\x03\x04")
    assert awake.write_read(0x40, b"\x06", 64) == b"\x01\x02\x03\x04" * 16
    assert awake.write_read(0x40, b"\xfa", 4) == bytes(4)


def test_test_mode_takes_nothing_and_is_warned_of(bus: I2cBusDouble, pca: Pca9685Double) -> None:
    bus.write(0x40, b"\xff\x55")
    assert register(bus, 0xFF) == 0
    assert "TestMode" in pca.warnings[0]


# PRE_SCALE


def test_pre_scale_is_ignored_unless_asleep(awake: I2cBusDouble, pca: Pca9685Double) -> None:
    awake.write(0x40, b"\xfe\x05")
    assert register(awake, 0xFE) == 0x1E
    assert "PRE_SCALE written awake" in pca.warnings[0]


def test_pre_scale_below_three_is_three(bus: I2cBusDouble) -> None:
    bus.write(0x40, b"\xfe\x00")
    assert register(bus, 0xFE) == 3


@pytest.mark.parametrize(
    ("pre_scale", "frequency_hz"),
    [(3, 1525.88), (5, 1017.25), (14, 406.90), (30, 196.89), (121, 50.03), (255, 23.84)],
)
def test_frequency_follows_pre_scale(
    bus: I2cBusDouble, pca: Pca9685Double, pre_scale: int, frequency_hz: float
) -> None:
    bus.write(0x40, bytes([0xFE, pre_scale]))
    assert pca.frequency_hz == pytest.approx(frequency_hz, abs=0.005)


def test_frequency_follows_the_true_oscillator(clock: ManualClock) -> None:
    # 26 MHz / (4096 * 31)
    assert Pca9685Double(clock, true_osc_hz=26e6).frequency_hz == pytest.approx(204.76, abs=0.005)


# Addresses


def test_all_call_answers_at_0x70_from_power_up_until_disabled(bus: I2cBusDouble) -> None:
    assert register(bus, 0x00, address=0x70) == 0x11
    bus.write(0x40, b"\x00\x10")
    with pytest.raises(NoAcknowledge):
        bus.write(0x70, b"\x00")


@pytest.mark.parametrize(("enable", "address"), [(0x08, 0x71), (0x04, 0x72), (0x02, 0x74)])
def test_sub_address_answers_once_enabled(bus: I2cBusDouble, enable: int, address: int) -> None:
    with pytest.raises(NoAcknowledge):
        bus.write(address, b"\x00")
    bus.write(0x40, bytes([0x00, 0x10 | enable]))
    assert register(bus, 0x01, address=address) == 0x04


def test_all_call_moves_with_its_register(bus: I2cBusDouble) -> None:
    bus.write(0x40, b"\x05\xaa")
    assert register(bus, 0x00, address=0x55) == 0x11
    with pytest.raises(NoAcknowledge):
        bus.write(0x70, b"\x00")


def test_all_call_writes_every_chip_and_reads_their_and(clock: ManualClock) -> None:
    chips = [Pca9685Double(clock, 0x40), Pca9685Double(clock, 0x41)]
    bus = I2cBusDouble("i2c-1", clock, chips)
    bus.write(0x40, b"\x02\xf0")
    bus.write(0x41, b"\x02\x3c")
    assert register(bus, 0x02, address=0x70) == 0x30
    bus.write(0x70, b"\x02\xaa")
    assert register(bus, 0x02, address=0x40) == register(bus, 0x02, address=0x41) == 0xAA


@pytest.mark.parametrize("address", [0x3F, 0x70, 0x80])
def test_address_a_pca9685_cannot_have_is_refused(clock: ManualClock, address: int) -> None:
    with pytest.raises(ValueError, match="expected 0x40 to 0x7f without 0x70"):
        Pca9685Double(clock, address)


# Software reset


def test_software_reset_by_general_call_resets_every_chip(clock: ManualClock) -> None:
    chips = [Pca9685Double(clock, 0x40), Pca9685Double(clock, 0x41)]
    bus = I2cBusDouble("i2c-1", clock, chips)
    for chip in chips:
        bus.write(chip.address, b"\x00\x21\x1f")
        bus.write(chip.address, b"\x09\x00")
    bus.write(0x00, b"\x06")
    for chip in chips:
        assert register(bus, 0x00, address=chip.address) == 0x11
        assert register(bus, 0x01, address=chip.address) == 0x04
        assert register(bus, 0x09, address=chip.address) == 0x10


@pytest.mark.parametrize("frame", [b"\x05", b"\x06\x06", b"\x06\x00"])
def test_general_call_with_anything_else_is_refused_and_resets_nothing(
    awake: I2cBusDouble, frame: bytes
) -> None:
    with pytest.raises(NoAcknowledge):
        awake.write(0x00, frame)
    assert register(awake, 0x00) == 0x21


def test_general_call_read_is_not_acknowledged(bus: I2cBusDouble) -> None:
    with pytest.raises(NoAcknowledge):
        bus.read(0x00, 1)


def test_software_reset_waits_for_stop(pca: Pca9685Double, awake: I2cBusDouble) -> None:
    assert pca.start(0x00, read=False)
    assert pca.write(0x06)
    pca.start(0x40, read=False)  # a repeated START aborts it
    pca.stop()
    assert register(awake, 0x00) == 0x21


def test_register_six_is_no_software_reset(awake: I2cBusDouble) -> None:
    awake.write(0x40, b"\x06\x00")
    assert register(awake, 0x00) == 0x21


def test_power_cycle_restores_the_power_up_values(awake: I2cBusDouble, pca: Pca9685Double) -> None:
    awake.write(0x40, b"\x01\x14")
    pca.power_cycle()
    assert register(awake, 0x00) == 0x11
    assert register(awake, 0x01) == 0x04
