"""MPU-9250 double: the AK8963 through the bypass and through the auxiliary master."""

import pytest

from firmware_runtime.hal.errors import NoAcknowledge
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import InertialTruth, Mpu9250Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

MILLISECOND = 1_000_000
FIELD_T = (15e-6, 30e-6, -45e-6)
# X 30 uT, Y 15 uT, Z 45 uT in the die's axes, 0.15 uT a count: 200, 100, 300, little-endian
DATA = b"\xc8\x00\x64\x00\x2c\x01"
ST2 = b"\x10"
BYPASS, MASTER = 0x02, 0x20


class Bench:
    """A chip at 1 kHz with a magnetometer, and the instants truth and field were asked for."""

    def __init__(self, clock: ManualClock, *, with_magnetometer: bool = True) -> None:
        self.clock = clock
        self.asked: list[int] = []
        self.magnetometer = Ak8963Double(clock, self._field, asa=(128, 128, 128))
        self.chip = Mpu9250Double(
            clock, self._inertia, magnetometer=self.magnetometer if with_magnetometer else None
        )
        self.bus = I2cBusDouble("i2c-1", clock, self.chip.targets)
        self.write(0x1A, 0x01)

    def _inertia(self, at: int) -> InertialTruth:
        self.asked.append(at)
        return InertialTruth((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), FIELD_T, 21.0)

    def _field(self, at: int) -> tuple[float, float, float]:
        self.asked.append(at)
        return FIELD_T

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

    def slave(self, number: int, address: int, register: int, control: int) -> None:
        self.write(0x25 + 3 * number, address, register, control)


@pytest.fixture
def bench(clock: ManualClock) -> Bench:
    return Bench(clock)


# Bypass


def test_host_reaches_the_magnetometer_through_the_bypass_only(bench: Bench) -> None:
    with pytest.raises(NoAcknowledge):
        bench.bus.read(0x0C, 1)
    bench.write(0x37, BYPASS)
    assert bench.bus.write_read(0x0C, b"\x00", 1) == b"\x48"


def test_auxiliary_master_closes_the_bypass(bench: Bench) -> None:
    bench.write(0x37, BYPASS)
    bench.write(0x6A, MASTER)
    with pytest.raises(NoAcknowledge):
        bench.bus.read(0x0C, 1)


def test_bypass_works_while_the_chip_sleeps(bench: Bench) -> None:
    bench.write(0x37, BYPASS)
    bench.write(0x6B, 0x40)
    assert bench.bus.write_read(0x0C, b"\x00", 1) == b"\x48"


def test_two_chips_in_bypass_collide_at_0x0c(clock: ManualClock) -> None:
    chips = []
    for address, asa in ((0x68, (0xF0, 0xF0, 0xF0)), (0x69, (0x3C, 0x3C, 0x3C))):
        magnetometer = Ak8963Double(clock, lambda _: FIELD_T, asa=asa)
        chips.append(
            Mpu9250Double(
                clock,
                lambda _: InertialTruth(FIELD_T, FIELD_T, FIELD_T, 21.0),
                address,
                magnetometer=magnetometer,
            )
        )
    bus = I2cBusDouble("i2c-1", clock, [target for chip in chips for target in chip.targets])
    bus.write(0x68, b"\x37\x02")
    bus.write(0x0C, b"\x0a\x1f")
    assert bus.write_read(0x0C, b"\x10", 1) == b"\xf0"
    bus.write(0x69, b"\x37\x02")
    bus.write(0x0C, b"\x0a\x1f")
    assert bus.write_read(0x0C, b"\x10", 1) == b"\x30"


def test_reset_of_the_chip_leaves_the_magnetometer_measuring(bench: Bench) -> None:
    bench.measure_at_100_hz()
    bench.write(0x6B, 0x80)
    bench.wait(100)
    bench.write(0x37, BYPASS)
    assert bench.bus.write_read(0x0C, b"\x0a", 1) == b"\x16"


def test_power_cycle_of_the_chip_takes_the_magnetometer_along(bench: Bench) -> None:
    bench.measure_at_100_hz()
    bench.chip.power_cycle()
    bench.wait(11)
    bench.write(0x37, BYPASS)
    assert bench.bus.write_read(0x0C, b"\x0a", 1) == b"\x00"


# Reading slaves


def test_nine_axes_come_in_one_burst_of_23_bytes(bench: Bench) -> None:
    bench.slave(0, 0x8C, 0x02, 0x88)
    bench.measure_at_100_hz()
    bench.wait(8)
    burst = bench.read(0x3A, 23)
    assert burst[15:] == b"\x01" + DATA + ST2
    assert (bench.bus.log[-1].address, bench.bus.log[-1].to_read) == (0x68, 23)


def test_master_reads_once_a_sample_and_so_clears_data_ready(bench: Bench) -> None:
    bench.slave(0, 0x8C, 0x02, 0x88)
    bench.measure_at_100_hz()
    ready = []
    for _ in range(20):
        bench.wait(1)
        ready.append(bench.read(0x49)[0])
    # samples at 1 ms, landings at 7.2 and 17.2 ms
    assert ready == [0] * 7 + [1] + [0] * 9 + [1] + [0] * 2


def test_burst_that_never_reads_st2_stays_stale(bench: Bench) -> None:
    bench.slave(0, 0x8C, 0x02, 0x87)
    bench.measure_at_100_hz()
    bench.wait(50)
    assert bench.read(0x49) == b"\x02"  # overrun, nothing new


def test_swapped_pairs_on_odd_registers_give_big_endian_data(bench: Bench) -> None:
    bench.slave(0, 0x8C, 0x03, 0xD7)  # EN, BYTE_SW, GRP, 7 bytes
    bench.measure_at_100_hz()
    bench.wait(8)
    assert bench.read(0x49, 7) == b"\x00\xc8\x00\x64\x01\x2c" + ST2


def test_swapped_pairs_on_even_registers(bench: Bench) -> None:
    bench.slave(0, 0x8C, 0x03, 0xC7)  # pairs (4, 5), (6, 7), (8, 9); 3 stands alone
    bench.measure_at_100_hz()
    bench.wait(8)
    assert bench.read(0x49, 7) == b"\xc8\x64\x00\x2c\x00\x10\x01"


def test_slaves_fill_external_data_in_their_order(bench: Bench) -> None:
    bench.slave(0, 0x8C, 0x00, 0x81)
    bench.slave(2, 0x8C, 0x01, 0x81)
    bench.slave(3, 0x8C, 0x00, 0x82)
    bench.write(0x6A, MASTER)
    bench.wait(1)
    assert bench.read(0x49, 5) == b"\x48\x9a\x48\x9a\x00"


def test_external_data_ends_after_24_bytes(bench: Bench) -> None:
    bench.slave(0, 0x8C, 0x00, 0x8F)
    bench.slave(1, 0x8C, 0x00, 0x8F)
    bench.write(0x6A, MASTER)
    bench.wait(1)
    # 0x00..0x0C, 0x00, 0x01; then nine more of the second slave
    assert bench.read(0x49, 24) == (b"\x48\x9a" + bytes(11) + b"\x48\x9a") + b"\x48\x9a" + bytes(7)
    assert bench.read(0x61, 2) == bytes(2)


def test_slave_without_register_reads_on_at_the_pointer(bench: Bench) -> None:
    bench.slave(0, 0x8C, 0x00, 0x81)
    bench.slave(1, 0x8C, 0x55, 0xA1)  # REG_DIS
    bench.write(0x6A, MASTER)
    bench.wait(1)
    assert bench.read(0x49, 2) == b"\x48\x9a"


def test_delayed_slave_runs_every_1_plus_mst_dly_samples(bench: Bench) -> None:
    bench.slave(0, 0x8C, 0x02, 0x88)
    bench.write(0x34, 0x04)
    bench.write(0x67, 0x01)
    bench.measure_at_100_hz()
    served = []
    for sample in range(1, 31):
        bench.wait(1)
        bench.write(0x36)  # only sets the pointer
        before = bench.magnetometer._pointer
        bench.magnetometer._pointer = 0x55
        bench.read(0x75)
        if bench.magnetometer._pointer != 0x55:
            served.append(sample)
        bench.magnetometer._pointer = before
    assert served


def test_slaves_wait_for_the_master_to_be_enabled(bench: Bench) -> None:
    bench.slave(0, 0x8C, 0x00, 0x81)
    bench.wait(5)
    assert bench.read(0x49) == b"\x00"


# Acknowledges


def test_wrong_address_sets_the_slaves_nack_and_keeps_its_data(bench: Bench) -> None:
    bench.slave(0, 0x8C, 0x00, 0x81)
    bench.slave(1, 0x8D, 0x00, 0x81)
    bench.write(0x6A, MASTER)
    bench.wait(1)
    assert bench.read(0x36) == b"\x02"
    assert bench.read(0x36) == b"\x00"
    assert bench.read(0x49, 2) == b"\x48\x00"
    bench.wait(1)
    assert bench.read(0x36) == b"\x02"


def test_chip_without_magnetometer_reports_nack(clock: ManualClock) -> None:
    bench = Bench(clock, with_magnetometer=False)
    bench.slave(0, 0x8C, 0x00, 0x81)
    bench.slave(3, 0x0C, 0x0A, 0x81)
    bench.write(0x6A, MASTER)
    bench.wait(1)
    assert bench.read(0x36) == b"\x09"
    assert bench.read(0x49) == b"\x00"


def test_master_reset_clears_its_status(bench: Bench) -> None:
    bench.slave(0, 0x8D, 0x00, 0x81)
    bench.write(0x6A, MASTER)
    bench.wait(1)
    bench.write(0x6A, 0x02)
    assert bench.read(0x36) == b"\x00"


# Writing slaves


def test_write_slave_starts_a_single_measurement_each_sample(bench: Bench) -> None:
    bench.write(0x19, 19)  # 50 Hz, as Linux runs it
    bench.slave(0, 0x8C, 0x03, 0xD7)
    bench.write(0x64, 0x11)
    bench.slave(1, 0x0C, 0x0A, 0x81)
    bench.write(0x6A, MASTER)
    bench.wait(20)
    assert bench.read(0x49, 7) == bytes(7)
    bench.wait(20)
    assert bench.read(0x49, 7) == b"\x00\xc8\x00\x64\x01\x2c" + ST2
    assert bench.magnetometer.warnings == []


def test_slave_4_writes_once_and_reports_done(bench: Bench) -> None:
    bench.write(0x31, 0x0C, 0x0A, 0x1F, 0x80)
    bench.write(0x6A, MASTER)
    assert bench.read(0x34) == b"\x80"
    bench.wait(1)
    assert bench.read(0x34) == b"\x00"
    assert bench.read(0x36) == b"\x40"
    bench.write(0x6A, 0x00)
    bench.write(0x37, BYPASS)
    assert bench.bus.write_read(0x0C, b"\x0a", 1) == b"\x1f"


def test_slave_4_reads_into_its_own_register(bench: Bench) -> None:
    bench.write(0x31, 0x8C, 0x00, 0x00, 0x80)
    bench.write(0x6A, MASTER)
    bench.wait(1)
    assert bench.read(0x35) == b"\x48"
    assert bench.read(0x49) == b"\x00"


def test_slave_4_reports_a_refusal(bench: Bench) -> None:
    bench.write(0x31, 0x8D, 0x00, 0x00, 0x80)
    bench.write(0x6A, MASTER)
    bench.wait(1)
    assert bench.read(0x36) == b"\x50"
    assert bench.read(0x34) == b"\x00"


# FIFO and order of time


def test_external_bytes_of_enabled_slaves_enter_the_fifo(bench: Bench) -> None:
    bench.slave(0, 0x8C, 0x00, 0x82)
    bench.slave(3, 0x8C, 0x01, 0x81)
    bench.write(0x23, 0x81)
    bench.write(0x24, 0x20)  # SLV3_FIFO
    bench.write(0x6A, MASTER | 0x40)
    bench.wait(2)
    assert bench.read(0x74, 10) == (b"\x00\x00" + b"\x48\x9a" + b"\x9a") * 2


def test_truth_and_field_are_asked_in_one_order_of_time(bench: Bench) -> None:
    bench.write(0x37, BYPASS)
    bench.bus.write(0x0C, b"\x0a\x16")
    for step in range(30):
        bench.clock.advance(1_700_000)
        if step % 3 == 0:
            bench.bus.write_read(0x0C, b"\x02", 8)
        elif step % 3 == 1:
            bench.read(0x3B, 6)
        else:
            bench.chip.catch_up()
    assert bench.asked == sorted(bench.asked)
    assert bench.asked.count(17_200_000) == 1


def test_field_is_asked_in_time_while_the_chip_sleeps(bench: Bench) -> None:
    bench.measure_at_100_hz()
    bench.write(0x6B, 0x40)
    bench.wait(7)
    bench.chip.catch_up()
    assert bench.asked == []
    bench.wait(1)
    bench.chip.catch_up()
    assert bench.asked == [7_200_000]
