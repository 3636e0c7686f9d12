"""A PCA9685 on a bus of its own, awake with auto-increment when a test needs outputs."""

import pytest

from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble


@pytest.fixture
def pca(clock: ManualClock) -> Pca9685Double:
    return Pca9685Double(clock)


@pytest.fixture
def bus(clock: ManualClock, pca: Pca9685Double) -> I2cBusDouble:
    return I2cBusDouble("i2c-1", clock, [pca])


@pytest.fixture
def awake(clock: ManualClock, bus: I2cBusDouble) -> I2cBusDouble:
    """Return the bus with the PCA9685 awake, auto-increment on, its oscillator stable."""
    bus.write(0x40, b"\x00\x21")
    clock.advance(1_000_000)
    return bus
