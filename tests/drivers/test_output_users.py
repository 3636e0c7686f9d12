"""Models on one PCA9685: what stops all of its outputs is refused beside anything else."""

from collections.abc import Callable

import pytest
from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.esc import Esc, EscSettings
from firmware_drivers.servo import Servos
from firmware_drivers.thrust_pairs import ThrustPairs, ThrustSettings

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import SettingError
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.servos import PAN, servos_settings


def chip() -> Pca9685:
    return Pca9685(I2cBusDouble("i2c1", lambda: 0, []))


def servos(on: Pca9685) -> None:
    Servos("head", on, servos_settings(PAN))


def esc(on: Pca9685) -> None:
    Esc("fan", on, EscSettings(3, 50.0, 1000.0, 2000.0, 0))


def thrust_pairs(on: Pca9685) -> None:
    ThrustPairs("thrust", on, ThrustSettings(0.4, 1000.0, 100.0, 50 * MILLISECOND, 8))


def bridge(on: Pca9685) -> None:
    HBridge(on, 8, 9, 10)


@pytest.mark.parametrize(
    ("first", "second", "alone"),
    [
        (servos, esc, "fan"),
        (esc, servos, "head"),
        (esc, thrust_pairs, "thrust"),
        (servos, bridge, "head"),
        (bridge, esc, "fan"),
    ],
)
def test_two_of_which_one_would_switch_the_other_off_are_refused(
    first: Callable[[Pca9685], None], second: Callable[[Pca9685], None], alone: str
) -> None:
    shared = chip()
    first(shared)
    with pytest.raises(SettingError, match=f"i2c1: {alone} turns all outputs off"):
        second(shared)
    second(chip())


def test_bridges_share_a_chip() -> None:
    shared = chip()
    bridge(shared)
    HBridge(shared, 13, 11, 12)
