"""MPU-9250 double: from the truth to words, and when a new sample is there."""

import math
from collections.abc import Callable

import pytest

from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.inertial_truth import InertialTruth

MILLISECOND = 1_000_000
G = 9.80665
DPS = math.pi / 180.0
ZERO = (0.0, 0.0, 0.0)


class Rig:
    """A chip on a bus, sampling at 1 kHz, and the instants the truth was asked for."""

    def __init__(self, clock: ManualClock, inertia: Callable[[int], InertialTruth]) -> None:
        self.clock = clock
        self.inertia = inertia
        self.asked: list[int] = []
        self.chip = Mpu9250Double(clock, self._ask, noise_seed=None)
        self.bus = I2cBusDouble("i2c-1", clock, self.chip.targets)
        self.write(0x19, 0x00, 0x01)  # SMPLRT_DIV, CONFIG: 1 kHz, 184 Hz

    def _ask(self, at: int) -> InertialTruth:
        self.asked.append(at)
        return self.inertia(at)

    def write(self, register: int, *content: int) -> None:
        self.bus.write(0x68, bytes([register, *content]))

    def read(self, register: int, length: int = 1) -> bytes:
        return self.bus.write_read(0x68, bytes([register]), length)

    def words(self, register: int, count: int = 3) -> list[int]:
        data = self.read(register, 2 * count)
        return [int.from_bytes(data[i : i + 2], "big", signed=True) for i in range(0, 2 * count, 2)]

    def wait(self, milliseconds: float) -> None:
        self.clock.advance(round(milliseconds * MILLISECOND))


def still(
    acceleration: tuple[float, float, float] = ZERO,
    rate: tuple[float, float, float] = ZERO,
    temperature_c: float = 21.0,
) -> Callable[[int], InertialTruth]:
    truth = InertialTruth(acceleration, rate, ZERO, temperature_c)
    return lambda _: truth


def ramp(per_second: float) -> Callable[[int], InertialTruth]:
    """Return a truth whose every value grows by `per_second`."""

    def at(instant: int) -> InertialTruth:
        value = per_second * instant / 1e9
        return InertialTruth((value, value, value), (value, value, value), ZERO, value)

    return at


# Scales


@pytest.mark.parametrize(("range_code", "counts"), [(0, 13107), (1, 6554), (2, 3277), (3, 1638)])
def test_100_dps_on_each_gyro_range(clock: ManualClock, range_code: int, counts: int) -> None:
    rig = Rig(clock, still(rate=(100 * DPS, -100 * DPS, 0.0)))
    rig.write(0x1B, range_code << 3)
    rig.wait(1)
    assert rig.words(0x43) == [counts, -counts, 0]


@pytest.mark.parametrize(("range_code", "counts"), [(0, 16384), (1, 8192), (2, 4096), (3, 2048)])
def test_1_g_on_each_accelerometer_range(clock: ManualClock, range_code: int, counts: int) -> None:
    rig = Rig(clock, still(acceleration=(G, 0.0, -G)))
    rig.write(0x1C, range_code << 3)
    rig.wait(1)
    assert rig.words(0x3B) == [counts, 0, -counts]


@pytest.mark.parametrize(("temperature_c", "counts"), [(21.0, 0), (25.0, 1335), (-10.0, -10350)])
def test_temperature_word(clock: ManualClock, temperature_c: float, counts: int) -> None:
    rig = Rig(clock, still(temperature_c=temperature_c))
    rig.wait(1)
    assert rig.words(0x41, 1) == [counts]


def test_words_saturate_at_full_scale(clock: ManualClock) -> None:
    rig = Rig(clock, still(acceleration=(3 * G, -3 * G, 2 * G), rate=(10.0, -10.0, 0.0)))
    rig.wait(1)
    assert rig.words(0x3B) == [32767, -32768, 32767]
    assert rig.words(0x43) == [32767, -32768, 0]


# Offsets and self-test


def test_gyro_offset_is_added_at_32_8_counts_a_dps(clock: ManualClock) -> None:
    rig = Rig(clock, still())
    rig.write(0x13, 0x01, 0x48, 0xFE, 0xB8, 0x00, 0x00)  # 328, -328: 10 dps
    rig.wait(1)
    assert rig.words(0x43) == [1312, -1312, 0]
    rig.write(0x1B, 0x18)
    rig.wait(1)
    assert rig.words(0x43) == [164, -164, 0]


def test_accelerometer_offset_moves_by_about_1_mg_a_step(clock: ManualClock) -> None:
    rig = Rig(clock, still())
    high, low = rig.read(0x77, 2)
    moved = (high << 8 | low) + (100 << 1)  # 100 steps in bits 15:1, bit 0 kept
    rig.write(0x77, moved >> 8, moved & 0xFF)
    rig.wait(1)
    assert rig.words(0x3B) == [1600, 0, 0]
    rig.write(0x1C, 0x18)
    rig.wait(1)
    assert rig.words(0x3B) == [200, 0, 0]


def test_self_test_adds_the_factory_deflection(clock: ManualClock) -> None:
    rig = Rig(clock, still())
    rig.write(0x1B, 0xE0)
    rig.write(0x1C, 0x40)
    rig.wait(1)
    gyro = [round(2620 * 1.01 ** (code - 1)) for code in rig.read(0x00, 3)]
    accelerometer = round(2620 * 1.01 ** (rig.read(0x0E)[0] - 1))
    assert rig.words(0x43) == gyro
    assert rig.words(0x3B) == [0, accelerometer, 0]
    assert min(gyro) > 60 * 131
    assert 0.225 * 16384 < accelerometer < 0.675 * 16384


def test_self_test_deflection_halves_with_each_range(clock: ManualClock) -> None:
    rig = Rig(clock, still())
    code = rig.read(0x00)[0]
    rig.write(0x1B, 0x90)
    rig.wait(1)
    assert rig.words(0x43) == [round(2620 / 4 * 1.01 ** (code - 1)), 0, 0]


# Filters


@pytest.mark.parametrize(
    ("dlpf", "delay_ms"), [(1, 2.9), (2, 3.9), (3, 5.9), (4, 9.9), (5, 17.85), (6, 33.48)]
)
def test_gyro_filter_delays_a_ramp_by_the_data_sheets_delay(
    clock: ManualClock, dlpf: int, delay_ms: float
) -> None:
    rig = Rig(clock, ramp(1000 * DPS))
    rig.write(0x1A, dlpf, 0x18)
    rig.wait(1500)
    # 16.384 counts a dps, 1 dps a ms
    assert rig.words(0x43)[0] == pytest.approx(16.384 * (1500 - delay_ms), abs=0.6)


@pytest.mark.parametrize(
    ("a_dlpf", "delay_ms"),
    [(0, 1.88), (1, 1.88), (2, 2.88), (3, 4.88), (4, 8.87), (5, 16.83), (6, 32.48), (7, 1.38)],
)
def test_accelerometer_filter_delays_a_ramp_by_the_data_sheets_delay(
    clock: ManualClock, a_dlpf: int, delay_ms: float
) -> None:
    rig = Rig(clock, ramp(G))
    rig.write(0x1D, a_dlpf)
    rig.wait(1500)
    # 16.384 counts a ms
    assert rig.words(0x3B)[0] == pytest.approx(16.384 * (1500 - delay_ms), abs=0.6)


def test_filter_delay_does_not_depend_on_the_sample_rate(clock: ManualClock) -> None:
    rig = Rig(clock, ramp(1000 * DPS))
    rig.write(0x19, 9, 3, 0x18)  # 100 Hz, 41 Hz
    rig.wait(1500)
    assert rig.words(0x43)[0] == pytest.approx(16.384 * (1500 - 5.9), abs=0.6)


def test_thermometer_can_be_stopped_alone_and_starts_again(clock: ManualClock) -> None:
    rig = Rig(clock, still(rate=(0.0, 0.0, 1.0), temperature_c=25.0))
    rig.wait(100)
    rig.write(0x6B, 0x09)  # PWR_MGMT_1: PD_PTAT
    rig.wait(10)
    assert rig.words(0x41, 1) == [0]
    assert rig.words(0x43)[2] == pytest.approx(131 * 180 / math.pi, abs=10)
    rig.write(0x6B, 0x01)
    rig.wait(10)
    assert rig.words(0x41, 1) == [1335]


def test_temperature_has_a_filter_of_its_own(clock: ManualClock) -> None:
    rig = Rig(clock, ramp(10.0))
    rig.write(0x1A, 6)
    rig.wait(1500)
    expected = (10.0 * (1.5 - 0.0186) - 21.0) * 333.87
    assert rig.words(0x41, 1)[0] == pytest.approx(expected, abs=0.6)


# The sample clock


@pytest.mark.parametrize(
    ("divider", "config", "gyro_config", "period"),
    [
        (0, 0x01, 0x00, 1_000_000),
        (4, 0x03, 0x00, 5_000_000),
        (255, 0x06, 0x00, 256_000_000),
        (9, 0x00, 0x00, 125_000),  # 8 kHz: the divider is not used
        (9, 0x07, 0x00, 125_000),
        (9, 0x03, 0x01, 31_250),  # FCHOICE_B: 32 kHz
        (9, 0x03, 0x02, 31_250),
    ],
)
def test_sample_rate(
    clock: ManualClock, divider: int, config: int, gyro_config: int, period: int
) -> None:
    rig = Rig(clock, still())
    rig.write(0x19, divider, config, gyro_config)
    start = clock()
    clock.advance(3 * period)
    rig.read(0x75)
    assert rig.asked[-3:] == [start + period, start + 2 * period, start + 3 * period]


def test_data_ready_is_set_by_a_sample_and_cleared_by_reading(clock: ManualClock) -> None:
    rig = Rig(clock, still())
    assert rig.read(0x3A) == b"\x00"
    rig.wait(1)
    assert rig.read(0x3A) == b"\x01"
    assert rig.read(0x3A) == b"\x00"
    rig.wait(1)
    assert rig.read(0x3A) == b"\x01"


def test_reading_data_leaves_data_ready_unless_anyrd_is_set(clock: ManualClock) -> None:
    rig = Rig(clock, still())
    rig.wait(1)
    rig.read(0x3B, 6)
    assert rig.read(0x3A) == b"\x01"
    rig.write(0x37, 0x10)
    rig.wait(1)
    rig.read(0x3B)
    assert rig.read(0x3A) == b"\x00"


def test_one_burst_holds_one_sample(clock: ManualClock) -> None:
    rig = Rig(clock, ramp(1000 * DPS))
    rig.write(0x1A, 1, 0x18)
    rig.wait(100)
    before = rig.words(0x43)
    rig.chip.start(0x68, read=False)
    rig.chip.write(0x43)
    rig.wait(10)
    rig.chip.start(0x68, read=True)
    high, low = rig.chip.read(), rig.chip.read()
    rig.wait(10)
    rest = bytes([rig.chip.read() for _ in range(4)])
    rig.chip.stop()
    assert bytes([high, low]) + rest == before[0].to_bytes(2, "big") * 3
    assert rig.words(0x43)[0] > before[0] + 19 * 16


def test_two_transactions_may_see_two_samples(clock: ManualClock) -> None:
    rig = Rig(clock, ramp(1000 * DPS))
    rig.write(0x1A, 1, 0x18)
    rig.wait(100)
    first = rig.read(0x43)
    rig.wait(20)
    assert rig.read(0x43) != first


def test_range_changed_between_samples_takes_effect_with_the_next(clock: ManualClock) -> None:
    rig = Rig(clock, still(acceleration=(G, 0.0, 0.0)))
    rig.wait(1)
    rig.write(0x1C, 0x08)
    assert rig.words(0x3B)[0] == 16384
    rig.wait(1)
    assert rig.words(0x3B)[0] == 8192


def test_truth_is_asked_once_a_sample_in_order_of_time(clock: ManualClock) -> None:
    rig = Rig(clock, still())
    rig.wait(10.5)
    rig.read(0x3A)
    rig.read(0x3A)
    rig.wait(2)
    rig.chip.catch_up()
    assert rig.asked == [n * MILLISECOND for n in range(1, 13)]
    assert rig.chip.samples == 12


def test_signal_path_reset_starts_the_filter_over(clock: ManualClock) -> None:
    rig = Rig(clock, ramp(1000 * DPS))
    rig.write(0x1A, 6, 0x18)
    rig.wait(1500)
    rig.write(0x68, 0x04)
    rig.wait(1)
    assert rig.words(0x43)[0] == round(16.384 * 1501)


def test_sig_cond_rst_clears_the_data_registers(clock: ManualClock) -> None:
    rig = Rig(clock, still(acceleration=(G, G, G)))
    rig.wait(1)
    rig.write(0x6A, 0x01)
    assert rig.read(0x3B, 14) == bytes(14)
    rig.wait(1)
    assert rig.words(0x3B) == [16384] * 3
