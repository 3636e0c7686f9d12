"""MPU-9250 double: the AK8963 through the bypass, and one order of time for both dies."""

import pytest

from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.magnetometer import BYPASS, FIELD_T, WiredMpu9250, still
from tests.support.wire import sentences


@pytest.fixture
def rig(clock: ManualClock) -> WiredMpu9250:
    rig = WiredMpu9250(clock)
    rig.write(0x1A, 0x01)
    return rig


@sentences(
    {
        "the host reaches the magnetometer through the bypass only": (
            "0x0c R 48 -> refused; W 37 02; 0x0c W 00, R 48"
        ),
        "the auxiliary master closes the bypass": "W 37 02; W 6a 20; 0x0c R 48 -> refused",
        "the bypass works while the chip sleeps": "W 37 02; W 6b 40; 0x0c W 00, R 48",
        "a reset of the chip leaves the magnetometer measuring": (
            "W 37 02; 0x0c W 0a 16; W 6b 80; 100 ms; W 37 02; 0x0c W 0a, R 16"
        ),
        "a power cycle of the chip takes the magnetometer along": (
            "W 37 02; 0x0c W 0a 16; power cycle; 11 ms; W 37 02; 0x0c W 0a, R 00"
        ),
    }
)
def test_the_bypass(rig: WiredMpu9250, lines: str) -> None:
    rig.play(lines)


def test_two_chips_in_bypass_collide_at_0x0c(clock: ManualClock) -> None:
    chips = []
    for address, factor in ((0x68, 0xF0), (0x69, 0x3C)):
        magnetometer = Ak8963Double(clock, lambda _: FIELD_T, asa=(factor,) * 3, noise_seed=None)
        chips.append(
            Mpu9250Double(clock, still(), address, magnetometer=magnetometer, noise_seed=None)
        )
    bus = I2cBusDouble("i2c-1", clock, [target for chip in chips for target in chip.targets])
    for address, read in ((0x68, b"\xf0"), (0x69, b"\x30")):
        bus.write(address, b"\x37\x02")
        bus.write(0x0C, b"\x0a\x1f")
        assert bus.write_read(0x0C, b"\x10", 1) == read


def test_truth_and_field_are_asked_in_one_order_of_time(rig: WiredMpu9250) -> None:
    rig.play("W 37 02", "0x0c W 0a 16")
    for step in range(30):
        rig.clock.advance(1_700_000)
        if step % 3 == 0:
            rig.bus.write_read(0x0C, b"\x02", 8)
        elif step % 3 == 1:
            rig.read(0x3B, 6)
        else:
            rig.chip.catch_up()
    assert rig.asked == sorted(rig.asked)
    assert rig.asked.count(17_200_000) == 1


def test_they_are_asked_in_one_order_of_time_while_a_message_is_on_the_wire(
    rig: WiredMpu9250,
) -> None:
    clock = rig.clock
    slow = I2cBusDouble("i2c-1", clock, rig.chip.targets, bus_hz=10_000, reach=clock.reach)
    slow.write(0x68, bytes((0x37, BYPASS)))
    slow.write(0x0C, b"\x0a\x16")
    for _ in range(30):
        slow.write(0x0C, b"\x0c\x00")
    rig.chip.catch_up()
    assert rig.asked == sorted(rig.asked)
    assert len(rig.asked) > 80


def test_field_is_asked_in_time_while_the_chip_sleeps(rig: WiredMpu9250) -> None:
    rig.measure_at_100_hz()
    rig.write(0x6B, 0x40)
    for milliseconds, asked in ((7, []), (1, [7_200_000])):
        rig.wait(milliseconds)
        rig.chip.catch_up()
        assert rig.asked == asked
