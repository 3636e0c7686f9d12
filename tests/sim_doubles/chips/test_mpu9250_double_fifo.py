"""MPU-9250 double: what enters the FIFO, how it is counted and read, what a full one does."""

import pytest

from sim_doubles.clock import ManualClock
from tests.support.magnetometer import WiredMpu9250, still
from tests.support.wire import sentences

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
