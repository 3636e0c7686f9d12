"""A PCA9685 on a bus of its own, awake with auto-increment when a test needs outputs."""

import pytest

from sim_doubles.clock import ManualClock
from tests.support.wired_pca9685 import WiredPca9685


@pytest.fixture
def asleep(clock: ManualClock) -> WiredPca9685:
    """Return the chip as after power-up."""
    return WiredPca9685(clock)


@pytest.fixture
def awake(asleep: WiredPca9685) -> WiredPca9685:
    """Return the chip awake, auto-increment on, its oscillator stable."""
    asleep.play("W 00 21; 1 ms")
    return asleep
