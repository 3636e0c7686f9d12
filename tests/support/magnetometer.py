"""What tests do to a magnetometer behind its MPU-9250."""

from firmware_runtime.hal.i2c import I2cBus


def disable_magnetometer(bus: I2cBus) -> None:
    """Close the AK8963's bus interface (I2CDIS) through the bypass, then let the master go on."""
    for address, written in (
        (0x68, b"\x6a\x00"),
        (0x68, b"\x37\x02"),
        (0x0C, b"\x0f\x1b"),
        (0x68, b"\x37\x00"),
        (0x68, b"\x6a\x20"),
    ):
        bus.write(address, written)
