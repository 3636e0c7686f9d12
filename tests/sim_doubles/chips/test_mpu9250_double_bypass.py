"""MPU-9250 double: the AK8963 through the bypass, and one order of time for both dies."""

import pytest

from firmware_runtime.hal.wire_errors import NoAcknowledge
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.inertial_truth import InertialTruth
from tests.support.magnetometer import BYPASS, MASTER, HostOfMagnetometer

MILLISECOND = 1_000_000
FIELD_T = (15e-6, 30e-6, -45e-6)


class Rig(HostOfMagnetometer):
    """A chip at 1 kHz with a magnetometer, and the instants truth and field were asked for."""

    def __init__(self, clock: ManualClock) -> None:
        self.asked: list[int] = []
        self.magnetometer = Ak8963Double(clock, self._field, asa=(128, 128, 128), noise_seed=None)
        self.chip = Mpu9250Double(
            clock, self._inertia, magnetometer=self.magnetometer, noise_seed=None
        )
        super().__init__(clock, I2cBusDouble("i2c-1", clock, self.chip.targets))

    def _inertia(self, at: int) -> InertialTruth:
        self.asked.append(at)
        return InertialTruth((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), FIELD_T, 21.0)

    def _field(self, at: int) -> tuple[float, float, float]:
        self.asked.append(at)
        return FIELD_T


@pytest.fixture
def rig(clock: ManualClock) -> Rig:
    return Rig(clock)


def test_host_reaches_the_magnetometer_through_the_bypass_only(rig: Rig) -> None:
    with pytest.raises(NoAcknowledge):
        rig.bus.read(0x0C, 1)
    rig.write(0x37, BYPASS)
    assert rig.bus.write_read(0x0C, b"\x00", 1) == b"\x48"


def test_auxiliary_master_closes_the_bypass(rig: Rig) -> None:
    rig.write(0x37, BYPASS)
    rig.write(0x6A, MASTER)
    with pytest.raises(NoAcknowledge):
        rig.bus.read(0x0C, 1)


def test_bypass_works_while_the_chip_sleeps(rig: Rig) -> None:
    rig.write(0x37, BYPASS)
    rig.write(0x6B, 0x40)
    assert rig.bus.write_read(0x0C, b"\x00", 1) == b"\x48"


def test_two_chips_in_bypass_collide_at_0x0c(clock: ManualClock) -> None:
    chips = []
    for address, asa in ((0x68, (0xF0, 0xF0, 0xF0)), (0x69, (0x3C, 0x3C, 0x3C))):
        magnetometer = Ak8963Double(clock, lambda _: FIELD_T, asa=asa, noise_seed=None)
        chips.append(
            Mpu9250Double(
                clock,
                lambda _: InertialTruth(FIELD_T, FIELD_T, FIELD_T, 21.0),
                address,
                magnetometer=magnetometer,
                noise_seed=None,
            )
        )
    bus = I2cBusDouble("i2c-1", clock, [target for chip in chips for target in chip.targets])
    bus.write(0x68, b"\x37\x02")
    bus.write(0x0C, b"\x0a\x1f")
    assert bus.write_read(0x0C, b"\x10", 1) == b"\xf0"
    bus.write(0x69, b"\x37\x02")
    bus.write(0x0C, b"\x0a\x1f")
    assert bus.write_read(0x0C, b"\x10", 1) == b"\x30"


def test_reset_of_the_chip_leaves_the_magnetometer_measuring(rig: Rig) -> None:
    rig.measure_at_100_hz()
    rig.write(0x6B, 0x80)
    rig.wait(100)
    rig.write(0x37, BYPASS)
    assert rig.bus.write_read(0x0C, b"\x0a", 1) == b"\x16"


def test_power_cycle_of_the_chip_takes_the_magnetometer_along(rig: Rig) -> None:
    rig.measure_at_100_hz()
    rig.chip.power_cycle()
    rig.wait(11)
    rig.write(0x37, BYPASS)
    assert rig.bus.write_read(0x0C, b"\x0a", 1) == b"\x00"


def test_truth_and_field_are_asked_in_one_order_of_time(rig: Rig) -> None:
    rig.write(0x37, BYPASS)
    rig.bus.write(0x0C, b"\x0a\x16")
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


def test_they_are_asked_in_one_order_of_time_while_a_message_is_on_the_wire(rig: Rig) -> None:
    clock = rig.clock
    slow = I2cBusDouble("i2c-1", clock, rig.chip.targets, bus_hz=10_000, reach=clock.reach)
    slow.write(0x68, bytes((0x37, BYPASS)))
    slow.write(0x0C, b"\x0a\x16")
    for _ in range(30):
        slow.write(0x0C, b"\x0c\x00")
    rig.chip.catch_up()
    assert rig.asked == sorted(rig.asked)
    assert len(rig.asked) > 80


def test_field_is_asked_in_time_while_the_chip_sleeps(rig: Rig) -> None:
    rig.measure_at_100_hz()
    rig.write(0x6B, 0x40)
    rig.wait(7)
    rig.chip.catch_up()
    assert rig.asked == []
    rig.wait(1)
    rig.chip.catch_up()
    assert rig.asked == [7_200_000]
