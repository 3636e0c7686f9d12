"""A magnetometer in tests: its die alone, and behind its MPU-9250."""

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.hal.i2c import I2cBus
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

BYPASS, MASTER = 0x02, 0x20


class Die:
    """An AK8963 with a field that tests set, and the instants it was asked for."""

    def __init__(self, clock: ManualClock, asa: tuple[int, int, int] = (176, 177, 164)) -> None:
        self.clock = clock
        self.field_t = (10e-6, 20e-6, -40e-6)
        self.asked: list[int] = []
        self.chip = Ak8963Double(clock, self._field, asa=asa, noise_seed=None)
        self.bus = I2cBusDouble("i2c-1", clock, [self.chip])

    def _field(self, at: int) -> tuple[float, float, float]:
        self.asked.append(at)
        return self.field_t

    def read(self, register: int, length: int = 1) -> bytes:
        return self.bus.write_read(0x0C, bytes([register]), length)

    def write(self, register: int, byte: int) -> None:
        self.bus.write(0x0C, bytes([register, byte]))


class HostOfMagnetometer:
    """What a host does to an MPU-9250 at 1 kHz, and by its bypass to the magnetometer in it."""

    def __init__(self, clock: ManualClock, bus: I2cBusDouble) -> None:
        self.clock = clock
        self.bus = bus
        self.write(0x1A, 0x01)

    def write(self, register: int, *content: int) -> None:
        self.bus.write(0x68, bytes([register, *content]))

    def read(self, register: int, length: int = 1) -> bytes:
        return self.bus.write_read(0x68, bytes([register]), length)

    def wait(self, milliseconds: int) -> None:
        self.clock.advance(milliseconds * MILLISECOND)

    def measure_at_100_hz(self) -> None:
        """Start the magnetometer through the bypass, then hand it to the master."""
        self.write(0x37, BYPASS)
        self.bus.write(0x0C, b"\x0a\x16")
        self.write(0x37, 0x00)
        self.write(0x6A, MASTER)


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
