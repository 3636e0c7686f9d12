"""Inertial chips in tests: a magnetometer's die alone, an MPU-9250 with or without one in it."""

from collections.abc import Callable

from firmware_runtime.hal.i2c import I2cBus
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.clock import ManualClock
from sim_doubles.inertial_truth import InertialTruth
from tests.support.wire import WiredChip

BYPASS, MASTER = 0x02, 0x20
NO_ADJUSTMENT = (128, 128, 128)
Vector = tuple[float, float, float]
ZERO = (0.0, 0.0, 0.0)
FIELD_T = (15e-6, 30e-6, -45e-6)


def still(
    acceleration: Vector = ZERO, rate: Vector = ZERO, temperature_c: float = 21.0
) -> Callable[[int], InertialTruth]:
    truth = InertialTruth(acceleration, rate, FIELD_T, temperature_c)
    return lambda _: truth


class Die(WiredChip[Ak8963Double]):
    """An AK8963 with a field that tests set, and the instants it was asked for."""

    def __init__(self, clock: ManualClock, asa: tuple[int, int, int] = (176, 177, 164)) -> None:
        self.field_t = (10e-6, 20e-6, -40e-6)
        self.asked: list[int] = []
        chip = Ak8963Double(clock, self._field, asa=asa, noise_seed=None)
        super().__init__(clock, chip, 0x0C, [chip])

    def _field(self, at: int) -> Vector:
        self.asked.append(at)
        return self.field_t


class WiredMpu9250(WiredChip[Mpu9250Double]):
    """An MPU-9250 at 1 kHz, and the instants its world was asked for, its field too."""

    def __init__(
        self,
        clock: ManualClock,
        inertia: Callable[[int], InertialTruth] | None = None,
        *,
        magnetometer: bool = True,
        noise_seed: int | None = None,
        **chip: int,
    ) -> None:
        self.asked: list[int] = []
        self._inertia = inertia or still()
        self.magnetometer = Ak8963Double(clock, self._field, asa=NO_ADJUSTMENT, noise_seed=None)
        double = Mpu9250Double(
            clock,
            self._truth,
            magnetometer=self.magnetometer if magnetometer else None,
            noise_seed=noise_seed,
            **chip,
        )
        super().__init__(clock, double, chip.get("address", 0x68), double.targets)

    def _truth(self, at: int) -> InertialTruth:
        self.asked.append(at)
        return self._inertia(at)

    def _field(self, at: int) -> Vector:
        self.asked.append(at)
        return FIELD_T

    def words(self, register: int, count: int = 3) -> list[int]:
        data = self.read(register, 2 * count)
        return [int.from_bytes(data[i : i + 2], "big", signed=True) for i in range(0, 2 * count, 2)]

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
