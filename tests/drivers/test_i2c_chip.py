"""Addresses of chips on I2C, as their data sheets have them."""

from collections.abc import Callable

import pytest
from firmware_drivers.chips.ads1115 import Ads1115
from firmware_drivers.chips.cmps12 import Cmps12
from firmware_drivers.chips.i2c_chip import I2cChip
from firmware_drivers.chips.md25 import Md25
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.srf08 import Srf08

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import I2cBus
from tests.support.bare_chip import RegisterBus


@pytest.mark.parametrize(
    ("make", "wrong", "expected"),
    [
        (Ads1115, (0x47, 0x4C), "0x48 to 0x4b"),
        (Cmps12, (0x5F, 0x68), "0x60 to 0x67"),
        (Md25, (0x57, 0x60), "0x58 to 0x5f"),
        (Mpu9250, (0x67, 0x6A), "0x68, 0x69"),
        (Pca9685, (0x3F, 0x80), "0x40 to 0x7f"),
        (Srf08, (0x6F, 0x80), "0x70 to 0x7f"),
    ],
)
def test_an_address_that_a_chip_cannot_have_is_refused(
    make: Callable[[I2cBus, int], I2cChip],
    wrong: tuple[int, int],
    expected: str,
) -> None:
    for address in wrong:
        with pytest.raises(SettingError, match=f"address: 0x{address:02x}, expected {expected}"):
            make(RegisterBus(), address)
