"""`sim_doubles.busio.I2C`: CircuitPython's bus on doubles."""

import errno
from array import array
from collections.abc import Iterator

import pytest

from sim_doubles.busio import I2C
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.plugged import plug


@pytest.fixture
def bus() -> Iterator[I2cBusDouble]:
    with plug(1, I2cBusDouble("i2c-1", ManualClock(), [Pca9685Double(ManualClock())])) as bus:
        yield bus


@pytest.fixture
def i2c(bus: I2cBusDouble) -> Iterator[I2C]:
    with I2C("SCL", "SDA", frequency=400_000) as i2c:
        assert i2c.try_lock()
        yield i2c
    assert bus.name == "i2c-1"


def test_only_the_part_of_a_buffer_is_written_and_read(i2c: I2C, bus: I2cBusDouble) -> None:
    answer = bytearray(4)
    i2c.writeto(0x40, b"\x99\x01\x98", start=1, end=2)
    i2c.readfrom_into(0x40, answer, start=1, end=3)
    assert answer == bytes([0, 0x04, 0x04, 0])
    i2c.writeto_then_readfrom(
        0x40, array("B", [7, 0xFE]), answer, out_start=1, out_end=2, in_start=3, in_end=4
    )
    assert answer == bytes([0, 0x04, 0x04, 0x1E])
    assert [str(each) for each in bus.log] == ["0x40 W 01", "0x40 R 04 04", "0x40 W fe, R 1e"]


def test_a_chip_that_is_absent_is_an_os_error(i2c: I2C) -> None:
    with pytest.raises(OSError, match=" ") as absent:
        i2c.writeto(0x41, b"")
    assert absent.value.errno == errno.EREMOTEIO


def test_the_bus_is_used_under_its_lock_alone(i2c: I2C) -> None:
    assert not i2c.try_lock()
    i2c.unlock()
    with pytest.raises(RuntimeError, match="lock"):
        i2c.writeto(0x40, b"")
    with pytest.raises(ValueError, match="ocked"):
        i2c.unlock()


def test_a_bus_given_up_is_not_used_and_one_that_is_not_plugged_in_is_not_there(i2c: I2C) -> None:
    assert i2c.scan() == [0x40, 0x70]  # the chip and its all-call address
    i2c.deinit()
    with pytest.raises(ValueError, match="deinit"):
        i2c.scan()
    with pytest.raises(FileNotFoundError):
        I2C(bus=7)
