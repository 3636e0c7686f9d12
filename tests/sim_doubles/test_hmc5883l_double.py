"""The HMC5883L's double by bytes; every expected value is worked out by hand."""

import math
from struct import unpack

import pytest

from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.clock import ManualClock
from tests.support.wire import WiredChip, sentences

CONTINUOUS, SINGLE = "W 02 00; 6 ms", "W 02 01; 6 ms"
DATA = "00 da fe 4c 00 6d"  # X 218, Z -436, Y 109
ALL_DATA = f"W 03, R {DATA}"
IDLE, READY, LOCKED = "W 09, R 00", "W 09, R 01", "W 09, R 02"
STRONG = "W 03, R 04 42 04 42 04 42"  # 1090 each
PERIOD_15_HZ = "66666667 ns"


class Wired(WiredChip[Hmc5883lDouble]):
    """A compass in a field that tests set, in T, and the instants at which it was asked for."""

    def __init__(self, clock: ManualClock) -> None:
        self.field = (20e-6, 10e-6, -40e-6)
        self.asked_at: list[int] = []
        chip = Hmc5883lDouble(clock, self._field, noise_seed=None)
        super().__init__(clock, chip, 0x1E, [chip])

    def _field(self, at: int) -> tuple[float, float, float]:
        self.asked_at.append(at)
        return self.field

    def axes(self) -> tuple[int, ...]:
        """Read X, Z and Y."""
        return unpack(">3h", self.read(0x03, 6))


@pytest.fixture
def fresh(clock: ManualClock) -> Wired:
    return Wired(clock)


@pytest.fixture
def compass(fresh: Wired) -> Wired:
    """Return one some time after power-up, idle."""
    fresh.wait(1000)
    fresh.chip.catch_up()
    fresh.asked_at.clear()
    return fresh


@sentences(
    {
        "power-up values": "W 00, R 10 20 01 00*6; W 09, R 00 48 34 33",
        "power-up measures once and is idle then": (
            f"6 ms; W 02, R 02; {ALL_DATA}; 1 s; {IDLE}; asked_at is [6_000_000]"
        ),
    }
)
def test_power_up(fresh: Wired, lines: str) -> None:
    fresh.play(lines)


@sentences(
    {
        "a single measurement takes 6 ms and leaves idle": (
            f"{ALL_DATA}; W 02 01; 5.999999 ms; {IDLE}; W 02, R 01; 1 ns; {READY}; W 02, R 02; "
            f"{ALL_DATA}; {IDLE}; asked_at is [1_006_000_000]"
        ),
        "writing CRB keeps the lock": (f"{CONTINUOUS}; W 03, R 00; W 01 20; {LOCKED}"),
        "RDY is low for 250 us before new data": (
            f"{CONTINUOUS}; {READY}; 66416666 ns; {READY}; 1 ns; {IDLE}; 250 us; {READY}"
        ),
        "the pointer loops over the data and over all registers": (
            f"{SINGLE}; W 03, R {DATA} 00 da fe; W 0a, R 48 34 33 10 20"
        ),
        "registers that do not exist read zero": "W 20, R 00 10",
        "averaging bits are kept and change nothing": (
            f"W 00 70 20 01; 6 ms; W 00, R 70; {ALL_DATA}"
        ),
        "idle measures nothing": f"W 02 03; 1 s; {ALL_DATA}; asked_at is []",
        "a reserved rate measures nothing and is warned of": (
            f"W 00 1c; 10 s; {ALL_DATA}; asked_at is []; warns reserved rate or bias in CRA"
        ),
        "reserved bits and read-only registers are warned of": (
            "W 00 90 21 06; W 0a 51; W 00, R 10 20 02; W 0a, R 48 34 33; "
            "warns 0x00 written 0x90; warns 0x01 written 0x21; warns 0x02 written 0x06; "
            "warns register 0x0a is read-only"
        ),
        "a power cycle brings back the power-up values": (
            f"W 00 78 a0 00; 1 s; power cycle; W 00, R 10 20 01 00*6; 6 ms; {ALL_DATA}"
        ),
    }
)
def test_measurements_and_registers(compass: Wired, lines: str) -> None:
    compass.play(lines)


PERIODS = (1_333_333_333, 666_666_667, 333_333_333, 133_333_333, 66_666_667, 33_333_333, 13_333_333)


@pytest.mark.parametrize(("rate", "period"), list(enumerate(PERIODS)))
def test_continuous_measurements_follow_the_rate(compass: Wired, rate: int, period: int) -> None:
    compass.write(0x00, rate << 2, 0x20, 0)
    first = compass.clock() + 6_000_000
    for wait in (6_000_000, period - 1, 1, period):
        compass.clock.advance(wait)
        compass.chip.catch_up()
    assert compass.asked_at == [first, first + period, first + 2 * period]


def test_only_the_last_of_many_measurements_is_carried_out(compass: Wired) -> None:
    compass.play("W 02 00")
    begun_at = compass.clock()
    compass.play("3600 s", ALL_DATA)
    (asked_at,) = compass.asked_at
    hour = 3_600_000_000_000
    assert hour - 66_666_667 < asked_at - begun_at <= hour
    assert (asked_at - begun_at - 6_000_000) % 66_666_667 == 0


@pytest.mark.parametrize(
    ("gain", "counts"), list(enumerate((1370, 1090, 820, 660, 440, 390, 330, 230)))
)
def test_gain_codes_give_their_counts_a_gauss(compass: Wired, gain: int, counts: int) -> None:
    compass.field = (1e-4, -1e-4, 0.5e-4)
    compass.play(f"W 01 {gain << 5:02x}", SINGLE, SINGLE)
    assert compass.axes() == (counts, counts // 2, -counts)


def test_the_first_measurement_after_a_change_of_gain_has_the_old_one(compass: Wired) -> None:
    compass.field = (1e-4, 0.0, 0.0)
    compass.play("W 01 a0 00; 7 ms; W 03, R 04 42 00*4", PERIOD_15_HZ, "W 03, R 01 86 00*4")


def test_after_a_silence_over_a_change_of_gain_the_new_one_counts(compass: Wired) -> None:
    compass.field = (1e-4, 0.0, 0.0)
    compass.play("W 01 a0 00; 1 s; W 03, R 01 86 00*4")


@pytest.mark.parametrize(
    ("gauss", "count"),
    [(1.8779, 2047), (1.8789, -4096), (-1.8789, -2048), (-1.8799, -4096), (50.0, -4096)],
)
def test_an_axis_out_of_range_reads_minus_4096_by_itself(
    compass: Wired, gauss: float, count: int
) -> None:
    compass.field = (0.0, gauss * 1e-4, 0.0)  # at 1090 counts a gauss
    compass.play(SINGLE)
    assert compass.axes() == (0, 0, count)


def test_averaging_eight_samples_leaves_noise_of_one_by_the_root_of_eight() -> None:
    noise = []
    for averaged in (0x10, 0x70):
        clock = ManualClock()
        chip = Hmc5883lDouble(clock, lambda _: (0.0, 0.0, 0.0))
        rig = WiredChip(clock, chip, 0x1E, [chip])
        rig.play(f"W 00 {averaged:02x} 00; {CONTINUOUS}")
        read: list[int] = []
        for _ in range(200):
            rig.play(PERIOD_15_HZ)
            read += unpack(">3h", rig.read(0x03, 6))
        noise.append(math.hypot(*read))
    assert noise[0] / noise[1] == pytest.approx(math.sqrt(8.0), rel=0.02)


@sentences(
    {
        "reading the rest of the data": f"1 s; W 05, R fe 4c 00 6d; {IDLE}; 1 ms",
        "writing the mode": "W 02 00; 6 ms",
        "writing CRA": "W 00 10; 6 ms",
    }
)
def test_data_read_in_part_are_locked_until(compass: Wired, lines: str) -> None:
    compass.play(CONTINUOUS, "W 03, R 00 da", LOCKED)
    compass.field = (1e-4, 1e-4, 1e-4)
    compass.play(lines, READY, STRONG)


@pytest.mark.parametrize(("bias", "sign"), [(1, 1), (2, -1)])
def test_self_test_measures_the_bias_alone(compass: Wired, bias: int, sign: int) -> None:
    compass.play(f"W 00 7{bias} a0 01; 6 ms", SINGLE)
    x, z, y = (sign * count for count in compass.axes())
    assert (x, y, z) == (452, 452, 421)  # 1.16, 1.16, 1.08 gauss at 390 a gauss
