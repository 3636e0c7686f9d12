"""MPU-9250 double: the AK8963 through the bypass and the auxiliary master."""

import pytest

from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.clock import ManualClock
from sim_doubles.faults import AbsentTarget, FaultScript
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.magnetometer import BYPASS, FIELD_T, WiredMpu9250, still
from tests.support.wire import sentences

# X 30 uT, Y 15 uT, Z 45 uT in the die's axes, 0.15 uT a count: 200, 100, 300, little-endian
DATA = "c8 00 64 00 2c 01"
SWAPPED = "00 c8 00 64 01 2c"
MASTER = "W 6a 20"
MEASURING = f"W 37 02; 0x0c W 0a 16; W 37 00; {MASTER}"
"""The magnetometer measures at 100 Hz, started through the bypass."""
NINE_AXES = f"W 25 8c 02 88; {MEASURING}"


@pytest.fixture
def rig(clock: ManualClock) -> WiredMpu9250:
    rig = WiredMpu9250(clock)
    rig.write(0x1A, 0x01)  # 1 kHz
    return rig


@sentences(
    {
        "nine axes come in one burst of 23 bytes": (
            f"{NINE_AXES}; 8 ms; W 3a, R 01 00*14 01 {DATA} 10"
        ),
        # the first read locked zeros
        "a slave that never reads ST2 never sees data": (
            f"W 25 8c 02 87; {MEASURING}; 18 ms; W 49, R 02 00*6; 100 ms; W 4a, R 00*6"
        ),
        # EN, BYTE_SW, GRP, 7 bytes
        "swapped pairs on odd registers give big-endian data": (
            f"W 25 8c 03 d7; {MEASURING}; 8 ms; W 49, R {SWAPPED} 10"
        ),
        # pairs (4, 5), (6, 7), (8, 9); 3 stands alone
        "swapped pairs on even registers": (
            f"W 25 8c 03 c7; {MEASURING}; 8 ms; W 49, R c8 64 00 2c 00 10 01"
        ),
        "slaves fill external data in their order": (
            f"W 25 8c 00 81; W 2b 8c 01 81; W 2e 8c 00 82; {MASTER}; 1 ms; W 49, R 48 9a 48 9a 00"
        ),
        # 0x00 to 0x0c, 0x00, 0x01; then nine of the second
        "external data end after 24 bytes": (
            f"W 25 8c 00 8f; W 28 8c 00 8f; {MASTER}; 1 ms; "
            "W 49, R 48 9a 00*11 48 9a 48 9a 00*7; W 61, R 00 00"
        ),
        # REG_DIS
        "a slave without register reads on at the pointer": (
            f"W 25 8c 00 81; W 28 8c 55 a1; {MASTER}; 1 ms; W 49, R 48 9a"
        ),
        "slaves wait for the master to be enabled": "W 25 8c 00 81; 5 ms; W 49, R 00",
        "a wrong address sets the slave's NACK and keeps its data": (
            f"W 25 8c 00 81; W 28 8d 00 81; {MASTER}; 1 ms; W 36, R 02; W 36, R 00; "
            "W 49, R 48 00; 1 ms; W 36, R 02"
        ),
        "a master reset clears its status": (f"W 25 8d 00 81; {MASTER}; 1 ms; W 6a 02; W 36, R 00"),
        # 50 Hz, as Linux runs it
        "a write slave starts a single measurement each sample": (
            f"W 19 13; W 25 8c 03 d7; W 64 11; W 28 0c 0a 81; {MASTER}; 20 ms; "
            f"W 49, R 00*7; 20 ms; W 49, R {SWAPPED} 10"
        ),
        "a write slave takes no place in external data": (
            f"W 63 16; W 25 0c 0a 81; W 28 8c 0a 81; {MASTER}; 1 ms; W 49, R 16"
        ),
        "slave 4 waits for its turn when delayed": (
            f"W 31 8c 00 00 84; W 67 10; {MASTER}; 4 ms; W 34, R 84; 1 ms; W 34, R 04 48"
        ),
        "slave 4 writes once and reports done": (
            f"W 31 0c 0a 1f 80; {MASTER}; W 34, R 80; 1 ms; W 34, R 00; W 36, R 40; "
            "W 6a 00; W 37 02; 0x0c W 0a, R 1f"
        ),
        "slave 4 reads into its own register": (
            f"W 31 8c 00 00 80; {MASTER}; 1 ms; W 35, R 48; W 49, R 00"
        ),
        "slave 4 reports a refusal": (f"W 31 8d 00 00 80; {MASTER}; 1 ms; W 36, R 50; W 34, R 00"),
        # SLV3_FIFO in 0x24
        "external bytes of enabled slaves enter the FIFO": (
            "W 25 8c 00 82; W 2e 8c 01 81; W 23 81; W 24 20; W 6a 60; 2 ms; "
            "W 74, R 00 00 48 9a 9a 00 00 48 9a 9a"
        ),
        "bytes of a slave without its bit, or that writes, enter no FIFO": (
            "W 25 8c 00 82; W 28 8c 01 81; W 2b 0c 0a 81; W 23 86; W 6a 60; 1 ms; "
            "W 72, R 00 03; W 74, R 00 00 9a"
        ),
    }
)
def test_the_auxiliary_master(rig: WiredMpu9250, lines: str) -> None:
    rig.play(lines)
    assert rig.magnetometer.warnings == []


@pytest.mark.parametrize(
    ("settings", "count", "expected"),
    [  # samples at 1 ms, landings at 7.2 and 17.2 ms
        pytest.param(
            [], 20, [0] * 7 + [1] + [0] * 9 + [1] + [0] * 2, id="once a sample clears data ready"
        ),
        pytest.param(  # served at 5, 10, 15... ms; landings at 27.2 ms too
            ["W 34 04", "W 67 01"],
            30,
            [0] * 9 + [1] * 5 + [0] * 5 + [1] * 5 + [0] * 5 + [1],
            id="delayed, every 1 + MST_DLY samples",
        ),
    ],
)
def test_the_master_reads_at_its_rate(
    rig: WiredMpu9250, settings: list[str], count: int, expected: list[int]
) -> None:
    rig.play(*settings, NINE_AXES)
    ready = []
    for _ in range(count):
        rig.wait(1)
        ready.append(rig.read(0x49)[0])
    assert ready == expected


def test_a_chip_without_magnetometer_reports_nack(clock: ManualClock) -> None:
    rig = WiredMpu9250(clock, magnetometer=False)
    rig.play("W 1a 01; W 25 8c 00 81", "W 2e 0c 0a 81", MASTER, "1 ms", "W 36, R 09", "W 49, R 00")


@pytest.mark.parametrize("address", ["0c", "8c"])
def test_the_master_ends_its_transactions_with_stop(rig: WiredMpu9250, address: str) -> None:
    rig.play(f"W 25 {address} 0a 81", MASTER, "1 ms")
    rig.chip.catch_up()
    assert not rig.magnetometer.start(0x0C, read=True)


@pytest.mark.parametrize("without", [FaultScript(), None], ids=["empty", "none"])
def test_a_magnetometer_that_a_fault_keeps_off_the_bus_does_not_answer_the_master(
    rig: WiredMpu9250, without: FaultScript | None
) -> None:
    rig.play(NINE_AXES, "8 ms", f"W 4a, R {DATA}")
    rig.bus.faults = FaultScript([AbsentTarget(target=rig.magnetometer)])
    rig.read(0x36)
    rig.wait(20)
    assert rig.read(0x36)[0] & 0x01  # SLV0 was not acknowledged
    rig.bus.faults = without
    for _ in range(2):
        rig.read(0x36)
        rig.wait(20)
    assert rig.read(0x36)[0] & 0x01 == 0
    rig.play(f"W 4a, R {DATA}")


@sentences(
    {
        "the host reaches the magnetometer through the bypass only": (
            "0x0c R 48 -> refused; W 37 02; 0x0c W 00, R 48"
        ),
        "the auxiliary master closes the bypass": "W 37 02; W 6a 20; 0x0c R 48 -> refused",
        "the bypass works while the chip sleeps": "W 37 02; W 6b 40; 0x0c W 00, R 48",
        "a reset of the chip leaves the magnetometer measuring": (
            "W 37 02; 0x0c W 0a 16; W 6b 80; 100 ms; W 37 02; 0x0c W 0a, R 16"
        ),
        "a power cycle of the chip takes the magnetometer along": (
            "W 37 02; 0x0c W 0a 16; power cycle; 11 ms; W 37 02; 0x0c W 0a, R 00"
        ),
    }
)
def test_the_bypass(rig: WiredMpu9250, lines: str) -> None:
    rig.play(lines)


def test_a_brown_out_of_the_chip_takes_the_magnetometer_along(rig: WiredMpu9250) -> None:
    rig.play("W 37 02; 0x0c W 0a 16")
    rig.chip.power_cycle()
    rig.play("11 ms; W 37 02; 0x0c W 0a, R 00")


def test_two_chips_in_bypass_collide_at_0x0c(clock: ManualClock) -> None:
    chips = []
    for address, factor in ((0x68, 0xF0), (0x69, 0x3C)):
        magnetometer = Ak8963Double(clock, lambda _: FIELD_T, asa=(factor,) * 3, noise_seed=None)
        chips.append(
            Mpu9250Double(clock, still(), address, magnetometer=magnetometer, noise_seed=None)
        )
    bus = I2cBusDouble("i2c-1", clock, [target for chip in chips for target in chip.targets])
    for address, read in ((0x68, b"\xf0"), (0x69, b"\x30")):
        bus.write(address, b"\x37\x02")
        bus.write(0x0C, b"\x0a\x1f")
        assert bus.write_read(0x0C, b"\x10", 1) == read


def test_truth_and_field_are_asked_in_one_order_of_time(rig: WiredMpu9250) -> None:
    rig.play("W 37 02", "0x0c W 0a 16")
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


def test_they_are_asked_in_one_order_of_time_while_a_message_is_on_the_wire(
    rig: WiredMpu9250,
) -> None:
    clock = rig.clock
    slow = I2cBusDouble("i2c-1", clock, rig.chip.targets, bus_hz=10_000, reach=clock.reach)
    slow.write(0x68, bytes((0x37, BYPASS)))
    slow.write(0x0C, b"\x0a\x16")
    for _ in range(30):
        slow.write(0x0C, b"\x0c\x00")
    rig.chip.catch_up()
    assert rig.asked == sorted(rig.asked)
    assert len(rig.asked) > 80


def test_field_is_asked_in_time_while_the_chip_sleeps(rig: WiredMpu9250) -> None:
    rig.measure_at_100_hz()
    rig.write(0x6B, 0x40)
    for milliseconds, asked in ((7, []), (1, [7_200_000])):
        rig.wait(milliseconds)
        rig.chip.catch_up()
        assert rig.asked == asked
