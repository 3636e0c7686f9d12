"""MPU-9250 double: register map, reset, power-up, power bits, FIFO."""

import pytest

from sim_doubles.clock import ManualClock
from tests.support.magnetometer import WiredMpu9250, still
from tests.support.wire import sentences

INERTIA = still((0.0, 0.0, 9.80665), (1.0, 1.0, 1.0), 25.0)
REST = "00 00 00 00 40 00 05 37"  # 0, 0, 1 g at +-2 g; 25 degC
DEAD_GYRO = f"W 3a, R 00 {REST} 00*6"


@pytest.fixture
def mpu(clock: ManualClock) -> WiredMpu9250:
    return WiredMpu9250(clock, INERTIA, magnetometer=False)


@sentences(
    {
        "identity and power-up values": (
            "W 75, R 71; W 6b, R 01; W 13, R 00*38; W 63, R 00*8; W 6c, R 00"
        ),
        "the pointer wraps at 0x7f": "W 7f 5a 11 22; W 7f, R 5a 11 22; W 00, R 11 22",
        "an unlisted register keeps what is written": "W 03 a5; W 03, R a5",
        "self-clearing bits read zero": "W 6a 07; W 68 07; W 6a, R 00; W 68, R 00",
        "a reset restores registers and reads 1 for 100 ms": (
            "W 1a 03 18; W 6b 80; 99.999999 ms; W 6b, R 81; 1 ns; W 6b, R 01; W 1a, R 00 00"
        ),
        "a write during reset is lost and warned of": (
            "W 6b 80; 99 ms; W 19 04; warns register 0x19 written during H_RESET; 1 ms; "
            "W 19, R 00; W 19 04; W 19, R 04"
        ),
        "the chip is deaf for 11 ms after power-up": (
            "W 19 04; power cycle; 10.999999 ms; W 75, R 71 -> refused; 1 ns; W 19, R 00"
        ),
        "I2C_IF_DIS makes the chip deaf until a power cycle": (
            "W 6a 10; W 75, R 71 -> refused; warns I2C_IF_DIS; power cycle; 11 ms; W 75, R 71"
        ),
        # 8 kHz after power-up
        "a chip powered for long has data at its first tick": (
            f"W 3a, R 00; 125 us; W 3a, R 01; W 3b, R {REST}"
        ),
        # 1 kHz; 1 rad/s is 57.296 dps, at 131.072 counts a dps
        "the gyro is silent for 35 ms after waking, and data not ready": (
            "W 6b 40; 10 ms; W 19 00 01; W 6b 01; W 3a, R 00; 19 ms; W 3a, R 00*7; 1 ms; "
            f"{DEAD_GYRO}; 14 ms; {DEAD_GYRO}; 1 ms; W 3a, R 01 {REST} 1d 56 1d 56 1d 56"
        ),
        "sleep keeps the last sample": (
            f"1 ms; W 3a, R 01; W 6b 41; samples is 8; 1 s; W 3a, R 00 {REST}; samples is 8"
        ),
        "a stopped clock keeps the last sample": (
            f"1 ms; W 3a, R 01; W 6b 07; samples is 8; 1 s; W 3a, R 00 {REST}; samples is 8"
        ),
        # accelerometer Z, gyro Y
        "an axis switched off reads zero": (
            "W 6c 0a; 1 ms; W 3f, R 00 00; W 43, R 1d 56 00 00 1d 56"
        ),
        "all gyro axes off leaves accelerometer data ready": f"W 6c 07; 1 ms; W 3a, R 01 {REST}",
        "cycle mode is warned of": "W 6b 21; warns CYCLE",
    }
)
def test_registers_and_power(mpu: WiredMpu9250, lines: str) -> None:
    mpu.play(lines)


@pytest.mark.parametrize("identity", [0x70, 0x73, 0x75])
def test_modules_with_another_die_can_be_had(clock: ManualClock, identity: int) -> None:
    mpu = WiredMpu9250(clock, magnetometer=False, address=0x69, who_am_i=identity)
    mpu.play(f"W 75, R {identity:02x}", "0x68 W 75, R 71 -> refused")


def test_factory_values_are_not_zero_and_come_back_with_a_reset(mpu: WiredMpu9250) -> None:
    places = (0x00, 0x01, 0x02, 0x0D, 0x0E, 0x0F, 0x77, 0x7A, 0x7D)
    factory = [mpu.read(place) for place in places]
    assert b"\x00" not in factory
    mpu.play("W 77 00", "W 6b 80", "100 ms")
    assert [mpu.read(place) for place in places] == factory


@pytest.mark.parametrize("number", [0x35, 0x36, 0x3A, 0x3B, 0x49, 0x60, 0x72, 0x73, 0x75])
def test_a_read_only_register_ignores_writes(mpu: WiredMpu9250, number: int) -> None:
    before = mpu.read(number)[0]
    mpu.play(
        f"W {number:02x} {~before & 0xFF:02x}",
        f"W {number:02x}, R {before:02x}",
        f"warns register 0x{number:02x} is read-only",
    )


def test_a_quicker_reset_can_be_had_for_drivers_that_hardly_wait(clock: ManualClock) -> None:
    mpu = WiredMpu9250(clock, magnetometer=False, reset_time=1_000_000)
    mpu.play("W 6b 80", "1 ms", "W 19 04", "W 19, R 04")


def test_a_sample_due_before_a_power_cycle_is_never_taken(mpu: WiredMpu9250) -> None:
    mpu.wait(10)
    mpu.chip.power_cycle()
    mpu.wait(1)
    mpu.chip.catch_up()
    assert mpu.asked == [10_000_000 + n * 125_000 for n in range(1, 9)]


@pytest.mark.parametrize("off", ["W 6b 80", "W 6b 11"], ids=["reset", "standby"])
def test_the_gyro_starts_up_again_after(mpu: WiredMpu9250, off: str) -> None:
    mpu.play(off, "100 ms", "W 43, R 00*6", "W 6b 01")
    mpu.read(0x3A)
    mpu.play("34 ms", "W 3a, R 00", "1 ms", "W 3a, R 01")


ACCELERATION, TEMPERATURE = "40 00 00 00 c0 00", "05 37"
# 0.1, 0.2, 0.3 rad/s in dps at 131.072 counts each: 751, 1502, 2253
RATE_X, RATE_Y, RATE_Z = "02 ef", "05 de", "08 cd"
SIX_AXES = f"{ACCELERATION} {RATE_X} {RATE_Y} {RATE_Z}"
FORCES, TEMPERATURES, VECTORS = ("W 23 08; W 6a 40", "W 23 80; W 6a 40", "W 23 78; W 6a 40")
OVERFLOWN, NOT_OVERFLOWN = "W 3a, R 11", "W 3a, R 01"


@pytest.fixture
def rig(clock: ManualClock) -> WiredMpu9250:
    """A chip at 1 kHz."""
    inertia = still((9.80665, 0.0, -9.80665), (0.1, 0.2, 0.3), 25.0)
    rig = WiredMpu9250(clock, inertia, magnetometer=False)
    rig.write(0x1A, 0x01)
    return rig


@pytest.mark.parametrize(
    ("enabled", "packet"),
    [
        ("08", ACCELERATION),
        ("80", TEMPERATURE),
        ("40", RATE_X),
        ("20", RATE_Y),
        ("10", RATE_Z),
        ("78", SIX_AXES),
        ("f8", f"{ACCELERATION} {TEMPERATURE} {RATE_X} {RATE_Y} {RATE_Z}"),
    ],
)
def test_packet_holds_the_enabled_blocks_in_register_order(
    rig: WiredMpu9250, enabled: str, packet: str
) -> None:
    count = 2 * len(packet.split())
    rig.play(f"W 23 {enabled}", "W 6a 40", "2 ms", f"W 72, R 00 {count:02x}")
    rig.play(f"W 74, R {packet} {packet}", "W 72, R 00 00")


@sentences(
    {
        "nothing enters while the FIFO is off, and its content stays": (
            f"{FORCES}; 3 ms; W 6a 00; 10 ms; W 72, R 00 12"
        ),
        "forty milliseconds at 1 kHz give 480 bytes": (
            f"{VECTORS}; 40 ms; W 72, R 01 e0; {NOT_OVERFLOWN}"
        ),
        "the 43rd packet overflows": (
            f"{VECTORS}; 42 ms; W 72, R 01 f8; {NOT_OVERFLOWN}; 1 ms; "
            f"W 72, R 02 00; {OVERFLOWN}; W 3a, R 00"
        ),
        "512 bytes fit, and not one packet more": (
            f"{TEMPERATURES}; 256 ms; W 72, R 02 00; {NOT_OVERFLOWN}; 1 ms; {OVERFLOWN}"
        ),
        # 516 bytes went in: the first four are gone
        "a full FIFO overwrites the oldest": (
            f"{VECTORS}; 43 ms; W 74, R {' '.join((SIX_AXES.split() * 43)[4:])}"
        ),
        "a full FIFO refuses the newest in mode 1": (
            f"W 1a 41; {VECTORS}; 43 ms; {OVERFLOWN}; "
            f"W 74, R {' '.join((SIX_AXES.split() * 43)[:512])}"
        ),
        # 300, and 420 afterwards
        "reading the high count latches both bytes": (
            f"{VECTORS}; 25 ms; W 72, R 01; 10 ms; W 73, R 2c; W 72, R 01 a4"
        ),
        "an empty FIFO repeats its last byte": (
            f"{TEMPERATURES}; 1 ms; W 6a 00; W 74, R 05 37 37 37 37"
        ),
        "a burst on the FIFO stays there": (
            f"{FORCES}; 2 ms; W 74, R {ACCELERATION}; R {ACCELERATION}"
        ),
        "the host may write into the FIFO": "W 74 aa bb; W 72, R 00 02; W 74, R aa bb",
        "a FIFO reset empties it while off": f"{FORCES}; 3 ms; W 6a 04; W 72, R 00 00; W 6a, R 00",
        "a FIFO reset while on is ignored and warned of": (
            f"{FORCES}; 3 ms; W 6a 44; W 72, R 00 12; warns FIFO_RST written with FIFO_EN"
        ),
    }
)
def test_the_fifo(rig: WiredMpu9250, lines: str) -> None:
    rig.play(lines)
