"""MPU-9250 double: the AK8963 through the auxiliary master, SLV0 to SLV4."""

import pytest

from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.clock import ManualClock
from sim_doubles.faults import AbsentTarget, FaultScript
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.inertial_truth import InertialTruth
from tests.support.magnetometer import BYPASS, MASTER, HostOfMagnetometer

MILLISECOND = 1_000_000
FIELD_T = (15e-6, 30e-6, -45e-6)
# X 30 uT, Y 15 uT, Z 45 uT in the die's axes, 0.15 uT a count: 200, 100, 300, little-endian
DATA = b"\xc8\x00\x64\x00\x2c\x01"
ST2 = b"\x10"
TRUTH = InertialTruth((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), FIELD_T, 21.0)


class Rig(HostOfMagnetometer):
    """A chip at 1 kHz whose master can be given a magnetometer to read."""

    def __init__(self, clock: ManualClock, *, with_magnetometer: bool = True) -> None:
        self.magnetometer = Ak8963Double(
            clock, lambda _: FIELD_T, asa=(128, 128, 128), noise_seed=None
        )
        present = self.magnetometer if with_magnetometer else None
        self.chip = Mpu9250Double(clock, lambda _: TRUTH, magnetometer=present, noise_seed=None)
        super().__init__(clock, I2cBusDouble("i2c-1", clock, self.chip.targets))

    def slave(self, number: int, address: int, register: int, control: int) -> None:
        self.write(0x25 + 3 * number, address, register, control)


@pytest.fixture
def rig(clock: ManualClock) -> Rig:
    return Rig(clock)


# Reading slaves


def test_nine_axes_come_in_one_burst_of_23_bytes(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x02, 0x88)
    rig.measure_at_100_hz()
    rig.wait(8)
    burst = rig.read(0x3A, 23)
    assert burst[15:] == b"\x01" + DATA + ST2
    assert (rig.bus.log[-1].address, rig.bus.log[-1].to_read) == (0x68, 23)


def test_master_reads_once_a_sample_and_so_clears_data_ready(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x02, 0x88)
    rig.measure_at_100_hz()
    ready = []
    for _ in range(20):
        rig.wait(1)
        ready.append(rig.read(0x49)[0])
    # samples at 1 ms, landings at 7.2 and 17.2 ms
    assert ready == [0] * 7 + [1] + [0] * 9 + [1] + [0] * 2


def test_slave_that_never_reads_st2_never_sees_data(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x02, 0x87)
    rig.measure_at_100_hz()
    rig.wait(18)
    assert rig.read(0x49, 7) == b"\x02" + bytes(6)  # samples lost: the first read locked zeros
    rig.wait(100)
    assert rig.read(0x4A, 6) == bytes(6)


def test_swapped_pairs_on_odd_registers_give_big_endian_data(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x03, 0xD7)  # EN, BYTE_SW, GRP, 7 bytes
    rig.measure_at_100_hz()
    rig.wait(8)
    assert rig.read(0x49, 7) == b"\x00\xc8\x00\x64\x01\x2c" + ST2


def test_swapped_pairs_on_even_registers(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x03, 0xC7)  # pairs (4, 5), (6, 7), (8, 9); 3 stands alone
    rig.measure_at_100_hz()
    rig.wait(8)
    assert rig.read(0x49, 7) == b"\xc8\x64\x00\x2c\x00\x10\x01"


def test_slaves_fill_external_data_in_their_order(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x00, 0x81)
    rig.slave(2, 0x8C, 0x01, 0x81)
    rig.slave(3, 0x8C, 0x00, 0x82)
    rig.write(0x6A, MASTER)
    rig.wait(1)
    assert rig.read(0x49, 5) == b"\x48\x9a\x48\x9a\x00"


def test_external_data_ends_after_24_bytes(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x00, 0x8F)
    rig.slave(1, 0x8C, 0x00, 0x8F)
    rig.write(0x6A, MASTER)
    rig.wait(1)
    # 0x00..0x0C, 0x00, 0x01; then nine more of the second slave
    assert rig.read(0x49, 24) == (b"\x48\x9a" + bytes(11) + b"\x48\x9a") + b"\x48\x9a" + bytes(7)
    assert rig.read(0x61, 2) == bytes(2)


def test_slave_without_register_reads_on_at_the_pointer(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x00, 0x81)
    rig.slave(1, 0x8C, 0x55, 0xA1)  # REG_DIS
    rig.write(0x6A, MASTER)
    rig.wait(1)
    assert rig.read(0x49, 2) == b"\x48\x9a"


def test_delayed_slave_runs_every_1_plus_mst_dly_samples(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x02, 0x88)
    rig.write(0x34, 0x04)
    rig.write(0x67, 0x01)
    rig.measure_at_100_hz()
    ready = []
    for _ in range(30):
        rig.wait(1)
        ready.append(rig.read(0x49)[0])
    # served at 5, 10, 15... ms; landings at 7.2, 17.2 and 27.2 ms
    assert ready == [0] * 9 + [1] * 5 + [0] * 5 + [1] * 5 + [0] * 5 + [1]


def test_slaves_wait_for_the_master_to_be_enabled(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x00, 0x81)
    rig.wait(5)
    assert rig.read(0x49) == b"\x00"


# Acknowledges


def test_wrong_address_sets_the_slaves_nack_and_keeps_its_data(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x00, 0x81)
    rig.slave(1, 0x8D, 0x00, 0x81)
    rig.write(0x6A, MASTER)
    rig.wait(1)
    assert rig.read(0x36) == b"\x02"
    assert rig.read(0x36) == b"\x00"
    assert rig.read(0x49, 2) == b"\x48\x00"
    rig.wait(1)
    assert rig.read(0x36) == b"\x02"


def test_chip_without_magnetometer_reports_nack(clock: ManualClock) -> None:
    rig = Rig(clock, with_magnetometer=False)
    rig.slave(0, 0x8C, 0x00, 0x81)
    rig.slave(3, 0x0C, 0x0A, 0x81)
    rig.write(0x6A, MASTER)
    rig.wait(1)
    assert rig.read(0x36) == b"\x09"
    assert rig.read(0x49) == b"\x00"


def test_master_reset_clears_its_status(rig: Rig) -> None:
    rig.slave(0, 0x8D, 0x00, 0x81)
    rig.write(0x6A, MASTER)
    rig.wait(1)
    rig.write(0x6A, 0x02)
    assert rig.read(0x36) == b"\x00"


# Writing slaves


def test_write_slave_starts_a_single_measurement_each_sample(rig: Rig) -> None:
    rig.write(0x19, 19)  # 50 Hz, as Linux runs it
    rig.slave(0, 0x8C, 0x03, 0xD7)
    rig.write(0x64, 0x11)
    rig.slave(1, 0x0C, 0x0A, 0x81)
    rig.write(0x6A, MASTER)
    rig.wait(20)
    assert rig.read(0x49, 7) == bytes(7)
    rig.wait(20)
    assert rig.read(0x49, 7) == b"\x00\xc8\x00\x64\x01\x2c" + ST2
    assert rig.magnetometer.warnings == []


def test_write_slave_takes_no_place_in_external_data(rig: Rig) -> None:
    rig.write(0x63, 0x16)
    rig.slave(0, 0x0C, 0x0A, 0x81)
    rig.slave(1, 0x8C, 0x0A, 0x81)
    rig.write(0x6A, MASTER)
    rig.wait(1)
    assert rig.read(0x49) == b"\x16"


@pytest.mark.parametrize("address", [0x0C, 0x8C])
def test_master_ends_its_transactions_with_stop(rig: Rig, address: int) -> None:
    rig.slave(0, address, 0x0A, 0x81)
    rig.write(0x6A, MASTER)
    rig.wait(1)
    rig.chip.catch_up()
    assert not rig.magnetometer.start(0x0C, read=True)


def test_slave_4_waits_for_its_turn_when_delayed(rig: Rig) -> None:
    rig.write(0x31, 0x8C, 0x00, 0x00, 0x84)
    rig.write(0x67, 0x10)
    rig.write(0x6A, MASTER)
    rig.wait(4)
    assert rig.read(0x34) == b"\x84"
    rig.wait(1)
    assert rig.read(0x34, 2) == b"\x04\x48"


def test_slave_4_writes_once_and_reports_done(rig: Rig) -> None:
    rig.write(0x31, 0x0C, 0x0A, 0x1F, 0x80)
    rig.write(0x6A, MASTER)
    assert rig.read(0x34) == b"\x80"
    rig.wait(1)
    assert rig.read(0x34) == b"\x00"
    assert rig.read(0x36) == b"\x40"
    rig.write(0x6A, 0x00)
    rig.write(0x37, BYPASS)
    assert rig.bus.write_read(0x0C, b"\x0a", 1) == b"\x1f"


def test_slave_4_reads_into_its_own_register(rig: Rig) -> None:
    rig.write(0x31, 0x8C, 0x00, 0x00, 0x80)
    rig.write(0x6A, MASTER)
    rig.wait(1)
    assert rig.read(0x35) == b"\x48"
    assert rig.read(0x49) == b"\x00"


def test_slave_4_reports_a_refusal(rig: Rig) -> None:
    rig.write(0x31, 0x8D, 0x00, 0x00, 0x80)
    rig.write(0x6A, MASTER)
    rig.wait(1)
    assert rig.read(0x36) == b"\x50"
    assert rig.read(0x34) == b"\x00"


def test_external_bytes_of_enabled_slaves_enter_the_fifo(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x00, 0x82)
    rig.slave(3, 0x8C, 0x01, 0x81)
    rig.write(0x23, 0x81)
    rig.write(0x24, 0x20)  # SLV3_FIFO
    rig.write(0x6A, MASTER | 0x40)
    rig.wait(2)
    assert rig.read(0x74, 10) == (b"\x00\x00" + b"\x48\x9a" + b"\x9a") * 2


def test_a_magnetometer_that_a_fault_keeps_off_the_bus_does_not_answer_the_master(rig: Rig) -> None:
    rig.slave(0, 0x8C, 0x02, 0x88)
    rig.measure_at_100_hz()
    rig.wait(8)
    answered = rig.read(0x49, 8)
    assert answered[1:7] == DATA
    gone = AbsentTarget(target=rig.magnetometer)
    rig.bus.faults = FaultScript([gone])
    rig.read(0x36)
    rig.wait(20)
    status, *_ = rig.read(0x36)
    assert status & 0x01  # SLV0 was not acknowledged
    rig.bus.faults = FaultScript()
    rig.read(0x36)
    rig.wait(20)
    rig.read(0x36)
    rig.wait(20)
    assert rig.read(0x36)[0] & 0x01 == 0
    assert rig.read(0x49, 8)[1:7] == DATA
