"""What smbus2 and our own bus see on a real adapter; runs in the program's own Python."""

import errno
import sys
from collections.abc import Callable, Mapping
from time import monotonic_ns
from typing import Final

from smbus2 import I2cFunc, SMBus, i2c_msg

from firmware_runtime.hal.linux import open_i2c
from firmware_runtime.hal.wire_errors import NoAcknowledge

SENSOR, WHO_AM_I, MPU_9250 = 0x68, 0x75, 0x71
PWM, FIRST_LED, AUTO_INCREMENT = 0x40, 0x06, 0x20
FREE: Final = 0x23
READINGS: Final = 50


def identity(device: str) -> str:
    """The sensor's identity."""
    with SMBus(device) as bus:
        found = bus.read_byte_data(SENSOR, WHO_AM_I)
    assert found == MPU_9250, f"WHO_AM_I is 0x{found:02x}, expected 0x{MPU_9250:02x}"
    return f"0x{found:02x}"


def functionality(device: str) -> str:
    """The bits of the adapter."""
    with SMBus(device) as bus:
        assert bus.funcs & I2cFunc.I2C, hex(bus.funcs)
        assert bus.funcs & I2cFunc.SMBUS_BYTE_DATA == I2cFunc.SMBUS_BYTE_DATA, hex(bus.funcs)
        assert not bus.funcs & I2cFunc.SMBUS_READ_BLOCK_DATA, hex(bus.funcs)
        return hex(bus.funcs)


def round_trip(device: str) -> str:
    """Sixteen bytes to the registers of four channels and back; then off again."""
    written = bytes((0x11, 0x02, 0x33, 0x04)) * 4
    with SMBus(device) as bus:
        bus.write_byte_data(PWM, 0x00, 0x11 | AUTO_INCREMENT)
        bus.i2c_rdwr(i2c_msg.write(PWM, bytes((FIRST_LED,)) + written))
        read = i2c_msg.read(PWM, len(written))
        bus.i2c_rdwr(i2c_msg.write(PWM, (FIRST_LED,)), read)
        bus.i2c_rdwr(i2c_msg.write(PWM, (0xFD, 0x10)))
    assert bytes(read) == written, f"read {bytes(read).hex(' ')}"
    return f"{len(written)} bytes"


def absent(device: str) -> str:
    """No chip answers."""
    with SMBus(device) as bus:
        refused_with = 0
        try:
            bus.read_byte_data(FREE, 0)
        except OSError as error:
            refused_with = error.errno or 0
    assert refused_with == errno.ENXIO, f"errno {refused_with}"
    ours = open_i2c("i2c1", device)
    try:
        ours.write(FREE, b"\x00")
    except NoAcknowledge as refused:
        return str(refused)
    raise AssertionError("an absent address was acknowledged")


def read_first(device: str) -> str:
    """A read, then a write to another address and a read there, in one transaction."""
    identity, mode = i2c_msg.read(SENSOR, 1), i2c_msg.read(PWM, 1)
    with SMBus(device) as bus:
        bus.i2c_rdwr(
            i2c_msg.write(SENSOR, (WHO_AM_I,)), identity, i2c_msg.write(PWM, (0x01,)), mode
        )
    found = bytes(identity) + bytes(mode)
    assert found == b"\x71\x04", found
    return found.hex(" ")


def burst(device: str) -> str:
    """How long 23 bytes take, in the median and at worst."""
    ours, took = open_i2c("i2c1", device), []
    for _ in range(READINGS):
        began_at = monotonic_ns()
        assert len(ours.write_read(SENSOR, b"\x3a", 23)) == 23
        took.append((monotonic_ns() - began_at) / 1e6)
    took.sort()
    return f"median {took[READINGS // 2]:.1f} ms, longest {took[-1]:.1f} ms"


PROBES: Final[Mapping[str, Callable[[str], str]]] = {
    probe.__name__: probe
    for probe in (identity, functionality, round_trip, absent, read_first, burst)
}

if __name__ == "__main__":
    sys.stdout.write(PROBES[sys.argv[1]](sys.argv[2]))
