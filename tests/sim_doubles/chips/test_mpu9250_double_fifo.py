"""MPU-9250 double: what enters the FIFO, how it is counted and read, what a full one does."""

import pytest

from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.inertial_truth import InertialTruth

MILLISECOND = 1_000_000
TRUTH = InertialTruth((9.80665, 0.0, -9.80665), (0.1, 0.2, 0.3), (0.0, 0.0, 0.0), 25.0)
ACCELERATION = b"\x40\x00\x00\x00\xc0\x00"
TEMPERATURE = b"\x05\x37"
# 0.1, 0.2, 0.3 rad/s in dps at 131.072 counts each: 751, 1502, 2253
RATE_X, RATE_Y, RATE_Z = b"\x02\xef", b"\x05\xde", b"\x08\xcd"
FIFO_ON, FIFO_RST = 0x40, 0x04


class Rig:
    """A chip at 1 kHz whose FIFO takes what `enabled` says."""

    def __init__(self, clock: ManualClock) -> None:
        self.clock = clock
        self.chip = Mpu9250Double(clock, lambda _: TRUTH, noise_seed=None)
        self.bus = I2cBusDouble("i2c-1", clock, self.chip.targets)
        self.write(0x1A, 0x01)

    def write(self, register: int, byte: int) -> None:
        self.bus.write(0x68, bytes([register, byte]))

    def read(self, register: int, length: int = 1) -> bytes:
        return self.bus.write_read(0x68, bytes([register]), length)

    def fill(self, enabled: int, milliseconds: int) -> None:
        self.write(0x23, enabled)
        self.write(0x6A, FIFO_ON)
        self.clock.advance(milliseconds * MILLISECOND)

    def count(self) -> int:
        return int.from_bytes(self.read(0x72, 2), "big")

    def overflown(self) -> bool:
        return bool(self.read(0x3A)[0] & 0x10)


@pytest.fixture
def rig(clock: ManualClock) -> Rig:
    return Rig(clock)


@pytest.mark.parametrize(
    ("enabled", "packet"),
    [
        (0x08, ACCELERATION),
        (0x80, TEMPERATURE),
        (0x40, RATE_X),
        (0x20, RATE_Y),
        (0x10, RATE_Z),
        (0x78, ACCELERATION + RATE_X + RATE_Y + RATE_Z),
        (0xF8, ACCELERATION + TEMPERATURE + RATE_X + RATE_Y + RATE_Z),
    ],
)
def test_packet_holds_the_enabled_blocks_in_register_order(
    rig: Rig, enabled: int, packet: bytes
) -> None:
    rig.fill(enabled, 2)
    assert rig.count() == 2 * len(packet)
    assert rig.read(0x74, 2 * len(packet)) == packet * 2
    assert rig.count() == 0


def test_nothing_enters_while_the_fifo_is_off_and_content_stays(rig: Rig) -> None:
    rig.fill(0x08, 3)
    rig.write(0x6A, 0x00)
    rig.clock.advance(10 * MILLISECOND)
    assert rig.count() == 18


def test_forty_milliseconds_at_1_khz_give_480_bytes(rig: Rig) -> None:
    rig.fill(0x78, 40)
    assert rig.count() == 480
    assert not rig.overflown()


def test_the_43rd_packet_overflows(rig: Rig) -> None:
    rig.fill(0x78, 42)
    assert rig.count() == 504
    assert not rig.overflown()
    rig.clock.advance(MILLISECOND)
    assert rig.count() == 512
    assert rig.overflown()
    assert not rig.overflown()


def test_full_fifo_overwrites_the_oldest(rig: Rig) -> None:
    rig.fill(0x78, 43)
    packet = ACCELERATION + RATE_X + RATE_Y + RATE_Z
    # 516 bytes went in: the first four are gone
    assert rig.read(0x74, 512) == (packet * 43)[4:]


def test_full_fifo_refuses_the_newest_in_mode_1(rig: Rig) -> None:
    rig.write(0x1A, 0x41)
    rig.fill(0x78, 43)
    packet = ACCELERATION + RATE_X + RATE_Y + RATE_Z
    assert rig.overflown()
    assert rig.read(0x74, 512) == (packet * 43)[:512]


def test_reading_the_high_count_latches_both_bytes(rig: Rig) -> None:
    rig.fill(0x78, 25)
    assert rig.read(0x72) == b"\x01"
    rig.clock.advance(10 * MILLISECOND)
    assert rig.read(0x73) == b"\x2c"  # still 300
    assert rig.count() == 420


def test_empty_fifo_repeats_its_last_byte(rig: Rig) -> None:
    rig.fill(0x80, 1)
    rig.write(0x6A, 0x00)
    assert rig.read(0x74, 5) == b"\x05\x37\x37\x37\x37"


def test_burst_on_the_fifo_stays_there(rig: Rig) -> None:
    rig.fill(0x08, 2)
    assert rig.read(0x74, 6) == ACCELERATION
    assert rig.bus.read(0x68, 6) == ACCELERATION


def test_host_may_write_into_the_fifo(rig: Rig) -> None:
    rig.bus.write(0x68, b"\x74\xaa\xbb")
    assert rig.count() == 2
    assert rig.read(0x74, 2) == b"\xaa\xbb"


def test_fifo_reset_empties_it_while_off(rig: Rig) -> None:
    rig.fill(0x08, 3)
    rig.write(0x6A, FIFO_RST)
    assert rig.count() == 0
    assert rig.read(0x6A) == b"\x00"
    assert rig.chip.warnings == []


def test_fifo_reset_while_on_is_ignored_and_warned_of(rig: Rig) -> None:
    rig.fill(0x08, 3)
    rig.write(0x6A, FIFO_ON | FIFO_RST)
    assert rig.count() == 18
    assert "FIFO_RST written with FIFO_EN set" in rig.chip.warnings[0]
