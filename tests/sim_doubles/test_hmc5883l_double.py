"""The HMC5883L's double by bytes; every expected value is worked out by hand."""

from struct import unpack

import pytest

from sim_doubles.chips.hmc5883l import Hmc5883lDouble
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble

MICROSECOND = 1_000
MILLISECOND = 1_000_000
SECOND = 1_000_000_000
ADDRESS = 0x1E
CONTINUOUS = b"\x02\x00"
SINGLE = b"\x02\x01"
RDY, LOCK = 0x01, 0x02
DATA = b"\x00\xda\xfe\x4c\x00\x6d"  # X 218, Z -436, Y 109


class Field:
    """The field in T, and when it was asked for."""

    def __init__(self) -> None:
        self.vector = (20e-6, 10e-6, -40e-6)
        self.asked_at: list[int] = []

    def __call__(self, at: int) -> tuple[float, float, float]:
        self.asked_at.append(at)
        return self.vector


@pytest.fixture
def field() -> Field:
    return Field()


@pytest.fixture
def compass(clock: ManualClock, field: Field) -> Hmc5883lDouble:
    """A compass some time after power-up, idle."""
    double = Hmc5883lDouble(clock, field, noise_seed=None)
    clock.advance(SECOND)
    double.catch_up()
    field.asked_at.clear()
    return double


@pytest.fixture
def bus(clock: ManualClock, compass: Hmc5883lDouble) -> I2cBusDouble:
    return I2cBusDouble("i2c-1", clock, [compass])


def status(bus: I2cBusDouble) -> int:
    return bus.write_read(ADDRESS, b"\x09", 1)[0]


def axes(bus: I2cBusDouble) -> tuple[int, ...]:
    """Read X, Z and Y."""
    return unpack(">3h", bus.write_read(ADDRESS, b"\x03", 6))


def test_power_up_values(clock: ManualClock, field: Field) -> None:
    bus = I2cBusDouble("i2c-1", clock, [Hmc5883lDouble(clock, field, noise_seed=None)])
    assert bus.write_read(ADDRESS, b"\x00", 9) == b"\x10\x20\x01" + bytes(6)
    assert bus.write_read(ADDRESS, b"\x09", 4) == b"\x00H43"


def test_power_up_measures_once_and_is_idle_then(clock: ManualClock, field: Field) -> None:
    bus = I2cBusDouble("i2c-1", clock, [Hmc5883lDouble(clock, field, noise_seed=None)])
    clock.advance(6 * MILLISECOND)
    assert bus.write_read(ADDRESS, b"\x02", 1) == b"\x02"
    assert bus.write_read(ADDRESS, b"\x03", 6) == DATA
    clock.advance(SECOND)
    assert status(bus) == 0
    assert field.asked_at == [6 * MILLISECOND]


def test_single_measurement_takes_6_ms_and_leaves_idle(
    bus: I2cBusDouble, clock: ManualClock, field: Field
) -> None:
    axes(bus)
    bus.write(ADDRESS, SINGLE)
    clock.advance(6 * MILLISECOND - 1)
    assert (status(bus), bus.write_read(ADDRESS, b"\x02", 1)) == (0, b"\x01")
    clock.advance(1)
    assert (status(bus), bus.write_read(ADDRESS, b"\x02", 1)) == (RDY, b"\x02")
    assert bus.write_read(ADDRESS, b"\x03", 6) == DATA
    assert status(bus) == 0
    assert field.asked_at == [SECOND + 6 * MILLISECOND]


@pytest.mark.parametrize(
    ("rate", "period"),
    [
        (0, 1_333_333_333),
        (1, 666_666_667),
        (2, 333_333_333),
        (3, 133_333_333),
        (4, 66_666_667),
        (5, 33_333_333),
        (6, 13_333_333),
    ],
)
def test_continuous_measurements_follow_the_rate(  # noqa: PLR0917 (fixtures and cases)
    bus: I2cBusDouble,
    clock: ManualClock,
    compass: Hmc5883lDouble,
    field: Field,
    rate: int,
    period: int,
) -> None:
    bus.write(ADDRESS, bytes([0, rate << 2, 0x20, 0]))
    first = clock() + 6 * MILLISECOND
    for wait in (6 * MILLISECOND, period - 1, 1, period):
        clock.advance(wait)
        compass.catch_up()
    assert field.asked_at == [first, first + period, first + 2 * period]


def test_only_the_last_of_many_measurements_is_carried_out(
    bus: I2cBusDouble, clock: ManualClock, field: Field
) -> None:
    bus.write(ADDRESS, CONTINUOUS)
    begun_at = clock()
    clock.advance(3600 * SECOND)
    axes(bus)
    (asked_at,) = field.asked_at
    assert 3600 * SECOND - 66_666_667 < asked_at - begun_at <= 3600 * SECOND
    assert (asked_at - begun_at - 6 * MILLISECOND) % 66_666_667 == 0


@pytest.mark.parametrize(
    ("gain", "counts"),
    [(0, 1370), (1, 1090), (2, 820), (3, 660), (4, 440), (5, 390), (6, 330), (7, 230)],
)
def test_gain_codes_give_their_counts_a_gauss(
    bus: I2cBusDouble, clock: ManualClock, field: Field, gain: int, counts: int
) -> None:
    field.vector = (1e-4, -1e-4, 0.5e-4)
    bus.write(ADDRESS, bytes([1, gain << 5]))
    for _ in range(2):
        bus.write(ADDRESS, SINGLE)
        clock.advance(6 * MILLISECOND)
    assert axes(bus) == (counts, counts // 2, -counts)


def test_the_first_measurement_after_a_change_of_gain_has_the_old_one(
    bus: I2cBusDouble, clock: ManualClock, field: Field
) -> None:
    field.vector = (1e-4, 0.0, 0.0)
    bus.write(ADDRESS, b"\x01\xa0\x00")
    clock.advance(6 * MILLISECOND)
    assert axes(bus)[0] == 1090
    clock.advance(66_666_667)
    assert axes(bus)[0] == 390


def test_after_a_silence_over_a_change_of_gain_the_new_one_counts(
    bus: I2cBusDouble, clock: ManualClock, field: Field
) -> None:
    field.vector = (1e-4, 0.0, 0.0)
    bus.write(ADDRESS, b"\x01\xa0\x00")
    clock.advance(SECOND)
    assert axes(bus)[0] == 390


@pytest.mark.parametrize(
    ("gauss", "count"),
    [(1.8779, 2047), (1.8789, -4096), (-1.8789, -2048), (-1.8799, -4096), (50.0, -4096)],
)
def test_an_axis_out_of_range_reads_minus_4096_by_itself(
    bus: I2cBusDouble, clock: ManualClock, field: Field, gauss: float, count: int
) -> None:
    field.vector = (0.0, gauss * 1e-4, 0.0)  # at 1090 counts a gauss
    bus.write(ADDRESS, SINGLE)
    clock.advance(6 * MILLISECOND)
    assert axes(bus) == (0, 0, count)


def test_reading_a_part_of_the_data_locks_it_until_all_six_are_read(
    bus: I2cBusDouble, clock: ManualClock, field: Field
) -> None:
    bus.write(ADDRESS, CONTINUOUS)
    clock.advance(6 * MILLISECOND)
    assert bus.write_read(ADDRESS, b"\x03", 2) == DATA[:2]
    assert status(bus) == LOCK
    field.vector = (1e-4, 1e-4, 1e-4)
    clock.advance(SECOND)
    assert bus.write_read(ADDRESS, b"\x05", 4) == DATA[2:]
    assert status(bus) == 0
    clock.advance(MILLISECOND)
    assert status(bus) == RDY
    assert axes(bus) == (1090, 1090, 1090)


@pytest.mark.parametrize("write", [b"\x02\x00", b"\x00\x10"])
def test_writing_mode_or_cra_releases_the_lock(
    bus: I2cBusDouble, clock: ManualClock, field: Field, write: bytes
) -> None:
    bus.write(ADDRESS, CONTINUOUS)
    clock.advance(6 * MILLISECOND)
    bus.write_read(ADDRESS, b"\x03", 5)
    field.vector = (1e-4, 1e-4, 1e-4)
    bus.write(ADDRESS, write)
    clock.advance(6 * MILLISECOND)
    assert status(bus) == RDY
    assert axes(bus) == (1090, 1090, 1090)


def test_writing_crb_keeps_the_lock(bus: I2cBusDouble, clock: ManualClock) -> None:
    bus.write(ADDRESS, CONTINUOUS)
    clock.advance(6 * MILLISECOND)
    bus.write_read(ADDRESS, b"\x03", 1)
    bus.write(ADDRESS, b"\x01\x20")
    assert status(bus) == LOCK


def test_rdy_is_low_for_250_us_before_new_data(bus: I2cBusDouble, clock: ManualClock) -> None:
    bus.write(ADDRESS, CONTINUOUS)
    clock.advance(6 * MILLISECOND)
    assert status(bus) == RDY
    clock.advance(66_666_667 - 250 * MICROSECOND - 1)
    assert status(bus) == RDY
    clock.advance(1)
    assert status(bus) == 0
    clock.advance(250 * MICROSECOND)
    assert status(bus) == RDY


def test_pointer_loops_over_the_data_and_over_all_registers(
    bus: I2cBusDouble, clock: ManualClock
) -> None:
    bus.write(ADDRESS, SINGLE)
    clock.advance(6 * MILLISECOND)
    assert bus.write_read(ADDRESS, b"\x03", 9) == DATA + DATA[:3]
    assert bus.write_read(ADDRESS, b"\x0a", 5) == b"H43\x10\x20"


def test_registers_that_do_not_exist_read_zero(bus: I2cBusDouble) -> None:
    assert bus.write_read(ADDRESS, b"\x20", 2) == b"\x00\x10"


@pytest.mark.parametrize(("bias", "sign"), [(1, 1), (2, -1)])
def test_self_test_measures_the_bias_alone(
    bus: I2cBusDouble, clock: ManualClock, bias: int, sign: int
) -> None:
    bus.write(ADDRESS, bytes([0, 0x70 | bias, 0xA0, 1]))
    clock.advance(6 * MILLISECOND)
    bus.write(ADDRESS, SINGLE)
    clock.advance(6 * MILLISECOND)
    x, z, y = (sign * count for count in axes(bus))
    assert (x, y, z) == (452, 452, 421)  # 1.16, 1.16, 1.08 gauss at 390 a gauss
    assert all(243 <= count <= 575 for count in (x, y, z))


def test_averaging_bits_are_kept_and_change_nothing(bus: I2cBusDouble, clock: ManualClock) -> None:
    bus.write(ADDRESS, b"\x00\x70\x20\x01")
    clock.advance(6 * MILLISECOND)
    assert bus.write_read(ADDRESS, b"\x00", 1) == b"\x70"
    assert bus.write_read(ADDRESS, b"\x03", 6) == DATA


def test_idle_measures_nothing(bus: I2cBusDouble, clock: ManualClock, field: Field) -> None:
    bus.write(ADDRESS, b"\x02\x03")
    clock.advance(SECOND)
    axes(bus)
    assert field.asked_at == []


def test_a_reserved_rate_measures_nothing_and_is_warned_of(
    bus: I2cBusDouble, clock: ManualClock, compass: Hmc5883lDouble, field: Field
) -> None:
    bus.write(ADDRESS, b"\x00\x1c")
    clock.advance(10 * SECOND)
    axes(bus)
    assert field.asked_at == []
    assert compass.warnings == [
        "HMC5883L: reserved rate or bias in CRA; this double measures nothing"
    ]


def test_reserved_bits_and_read_only_registers_are_warned_of(
    bus: I2cBusDouble, compass: Hmc5883lDouble
) -> None:
    bus.write(ADDRESS, b"\x00\x90\x21\x06")
    bus.write(ADDRESS, b"\x0a\x51")
    assert bus.write_read(ADDRESS, b"\x00", 3) == b"\x10\x20\x02"
    assert bus.write_read(ADDRESS, b"\x0a", 3) == b"H43"
    assert compass.warnings == [
        "HMC5883L: register 0x00 written 0x90; its reserved bits must be 0",
        "HMC5883L: register 0x01 written 0x21; its reserved bits must be 0",
        "HMC5883L: register 0x02 written 0x06; its reserved bits must be 0",
        "HMC5883L: register 0x0a is read-only; the write is ignored",
    ]


def test_a_power_cycle_brings_back_the_power_up_values(
    bus: I2cBusDouble, clock: ManualClock
) -> None:
    bus.write(ADDRESS, b"\x00\x78\xa0\x00")
    clock.advance(SECOND)
    bus.power_cycle()
    assert bus.write_read(ADDRESS, b"\x00", 9) == b"\x10\x20\x01" + bytes(6)
    clock.advance(6 * MILLISECOND)
    assert bus.write_read(ADDRESS, b"\x03", 6) == DATA
