"""PCA9685 double: what the load sees, and when it changes."""

import pytest

from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

ALL_OFF = b"\xfd\x10"


@pytest.mark.parametrize(
    ("counts", "duty"),
    [
        (b"\x00\x00\x00\x08", 0.5),  # ON 0, OFF 2048
        (b"\x99\x01\xcc\x04", 0.199951171875),  # ON 409, OFF 1228: 819 / 4096
        (b"\x00\x0c\x00\x04", 0.5),  # ON 3072, OFF 1024: across the wrap
        (b"\xff\x0f\x00\x00", 1 / 4096),  # ON 4095, OFF 0
        (b"\x01\x00\x00\x00", 4095 / 4096),  # ON 1, OFF 0
        (b"\x00\x10\x00\x00", 1.0),  # full-on
        (b"\x00\x10\x00\x08", 1.0),  # full-on, OFF count ignored
        (b"\x00\x00\x00\x18", 0.0),  # full-off, OFF count ignored
        (b"\x00\x10\x00\x10", 0.0),  # full-off wins over full-on
        (b"\x34\x02\x34\x02", 0.0),  # ON == OFF
    ],
)
def test_duty_follows_counts_and_flags(
    awake: I2cBusDouble, pca: Pca9685Double, counts: bytes, duty: float
) -> None:
    awake.write(0x40, b"\x0a" + counts)
    assert pca.duty(1) == duty
    assert pca.duties == (0.0, duty) + (0.0,) * 14


def test_equal_counts_are_warned_of_once(awake: I2cBusDouble, pca: Pca9685Double) -> None:
    awake.write(0x40, b"\x0a\x34\x02\x34\x02")
    awake.write(0x40, b"\x0e\x00\x00\x00\x08")
    assert len(pca.warnings) == 1
    assert "channel 1 has ON == OFF == 564" in pca.warnings[0]


def test_burst_of_eight_channels_changes_all_at_one_instant(
    awake: I2cBusDouble, pca: Pca9685Double
) -> None:
    seen: list[tuple[float, ...]] = []
    pca.before_change = lambda: seen.append(pca.duties[:8])
    awake.write(0x40, b"\x06" + b"\x00\x00\x00\x08" * 8)
    awake.write(0x40, b"\x06" + b"\x00\x00\x00\x04" * 8)
    assert seen == [(0.0,) * 8, (0.5,) * 8]
    assert pca.duties[:8] == (0.25,) * 8


def test_world_is_not_called_when_no_output_changes(
    awake: I2cBusDouble, pca: Pca9685Double
) -> None:
    awake.write(0x40, b"\x06\x00\x00\x00\x08")
    calls: list[int] = []
    pca.before_change = lambda: calls.append(1)
    awake.write(0x40, b"\x06\x00\x00\x00\x08")
    awake.write(0x40, b"\x05\xe0")
    assert calls == []


def test_four_single_writes_pass_through_torn_values(
    awake: I2cBusDouble, pca: Pca9685Double
) -> None:
    awake.write(0x40, b"\x06\x00\x00\x80\x00")  # 128 / 4096
    seen: list[float] = []
    pca.before_change = lambda: seen.append(pca.duty(0))
    for register, byte in zip(range(6, 10), b"\x00\x00\x10\x02", strict=True):
        awake.write(0x40, bytes([register, byte]))
    assert seen == [128 / 4096, 16 / 4096]
    assert pca.duty(0) == 528 / 4096


def test_outputs_change_at_stop_and_not_before(awake: I2cBusDouble, pca: Pca9685Double) -> None:
    del awake
    pca.start(0x40, read=False)
    for byte in b"\x06\x00\x00\x00\x08":
        pca.write(byte)
    assert pca.duty(0) == 0.0
    pca.stop()
    assert pca.duty(0) == 0.5


def test_with_och_a_channel_changes_at_its_fourth_acknowledge(
    awake: I2cBusDouble, pca: Pca9685Double
) -> None:
    awake.write(0x40, b"\x01\x0c")
    pca.start(0x40, read=False)
    for byte in b"\x06\x00\x00\x00":
        pca.write(byte)
    assert pca.duty(0) == 0.0
    pca.write(0x08)
    assert pca.duty(0) == 0.5
    for byte in b"\x00\x00\x00":
        pca.write(byte)
    pca.stop()
    assert pca.duty(1) == 0.0


def test_with_och_a_lone_register_changes_nothing(awake: I2cBusDouble, pca: Pca9685Double) -> None:
    awake.write(0x40, b"\x01\x0c")
    awake.write(0x40, b"\x06\x00\x00\x00\x08")
    awake.write(0x40, b"\x09\x04")
    assert pca.duty(0) == 0.5


def test_three_byte_stop_takes_all_channels_off(awake: I2cBusDouble, pca: Pca9685Double) -> None:
    awake.write(0x40, b"\xfa\x00\x00\x00\x08")
    assert pca.duties == (0.5,) * 16
    bits = awake.bits
    awake.write(0x40, ALL_OFF)
    assert awake.bits - bits == 29
    assert pca.all_off
    assert awake.write_read(0x40, b"\x09", 1) == b"\x10"  # the count is lost


def test_outputs_go_on_after_the_bus_is_closed(awake: I2cBusDouble, pca: Pca9685Double) -> None:
    awake.write(0x40, b"\xfa\x00\x00\x00\x08")
    awake.close()
    assert pca.running
    assert pca.duties == (0.5,) * 16


def test_power_cycle_stops_outputs_and_advances_the_world_first(
    awake: I2cBusDouble, pca: Pca9685Double
) -> None:
    awake.write(0x40, b"\xfa\x00\x00\x00\x08")
    seen: list[float] = []
    pca.before_change = lambda: seen.append(pca.duty(15))
    pca.power_cycle()
    assert seen == [0.5]
    assert pca.all_off
    assert not pca.running


# Polarity, drivers and OE


def test_invrt_inverts_the_duty(awake: I2cBusDouble, pca: Pca9685Double) -> None:
    awake.write(0x40, b"\x06\x00\x00\x00\x04")
    awake.write(0x40, b"\x01\x14")
    assert pca.duty(0) == 0.75
    assert pca.duty(1) == 1.0


def test_open_drain_never_drives_high(awake: I2cBusDouble, pca: Pca9685Double) -> None:
    awake.write(0x40, b"\x06\x00\x00\x00\x04")
    awake.write(0x40, b"\x01\x00")
    assert pca.all_off


@pytest.mark.parametrize(
    ("mode2", "level"), [(0x04, 0.0), (0x05, 1.0), (0x01, 0.0), (0x06, 0.0), (0x07, 0.0)]
)
def test_oe_high_takes_outputs_to_what_outne_says(
    awake: I2cBusDouble, pca: Pca9685Double, mode2: int, level: float
) -> None:
    awake.write(0x40, bytes([0x01, mode2]))
    awake.write(0x40, b"\xfa\x00\x00\x00\x08")
    pca.output_enabled = False
    assert pca.duties == (level,) * 16


def test_invrt_does_not_apply_while_oe_is_high(awake: I2cBusDouble, pca: Pca9685Double) -> None:
    awake.write(0x40, b"\x01\x14")
    pca.output_enabled = False
    assert pca.all_off
    pca.output_enabled = True
    assert pca.duties == (1.0,) * 16


def test_oe_high_holds_asleep_too(bus: I2cBusDouble, pca: Pca9685Double) -> None:
    bus.write(0x40, b"\x01\x05")
    pca.output_enabled = False
    assert not pca.running
    assert pca.duties == (1.0,) * 16


def test_oe_advances_the_world_before_outputs_change(
    awake: I2cBusDouble, pca: Pca9685Double
) -> None:
    awake.write(0x40, b"\xfa\x00\x00\x00\x08")
    seen: list[float] = []
    pca.before_change = lambda: seen.append(pca.duty(0))
    pca.output_enabled = False
    pca.output_enabled = True
    assert seen == [0.5, 0.0]


def test_power_up_is_asleep_and_low(clock: ManualClock) -> None:
    fresh = Pca9685Double(clock)
    assert fresh.all_off
    assert not fresh.running
