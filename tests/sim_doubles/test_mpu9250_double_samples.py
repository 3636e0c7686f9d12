"""MPU-9250 double: from the truth to words, when a sample is there, long silence."""

import math
from collections.abc import Callable, Sequence

import pytest

from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.inertial_truth import InertialTruth
from tests.support.magnetometer import ZERO, WiredMpu9250, still
from tests.support.wire import UNITS

G = 9.80665
DPS = math.pi / 180.0
ACCELERATION, TEMPERATURE, RATE = 0x3B, 0x41, 0x43
Truth = Callable[[int], InertialTruth]


def at_1_khz(clock: ManualClock, inertia: Truth, *settings: Sequence[int]) -> WiredMpu9250:
    """A chip with these registers written, beside SMPLRT_DIV and CONFIG: 1 kHz, 184 Hz."""
    rig = WiredMpu9250(clock, inertia, magnetometer=False)
    for register, *content in ((0x19, 0x00, 0x01), *settings):
        rig.write(register, *content)
    return rig


def ramp(per_second: float) -> Truth:
    """Return a truth whose every value grows by `per_second`."""

    def at(instant: int) -> InertialTruth:
        value = per_second * instant / 1e9
        return InertialTruth((value, value, value), (value, value, value), ZERO, value)

    return at


# Words


SPINNING = still(rate=(100 * DPS, -100 * DPS, 0.0))
LYING = still(acceleration=(G, 0.0, -G))
BEYOND = still(acceleration=(3 * G, -3 * G, 2 * G), rate=(10.0, -10.0, 0.0))
TEN_DPS_OFF = (0x13, 0x01, 0x48, 0xFE, 0xB8, 0x00, 0x00)  # 328, -328 at 32.8 counts a dps


@pytest.mark.parametrize(
    ("inertia", "settings", "register", "words"),
    [
        (SPINNING, [(0x1B, 0 << 3)], RATE, [13107, -13107, 0]),
        (SPINNING, [(0x1B, 1 << 3)], RATE, [6554, -6554, 0]),
        (SPINNING, [(0x1B, 2 << 3)], RATE, [3277, -3277, 0]),
        (SPINNING, [(0x1B, 3 << 3)], RATE, [1638, -1638, 0]),
        (LYING, [(0x1C, 0 << 3)], ACCELERATION, [16384, 0, -16384]),
        (LYING, [(0x1C, 1 << 3)], ACCELERATION, [8192, 0, -8192]),
        (LYING, [(0x1C, 2 << 3)], ACCELERATION, [4096, 0, -4096]),
        (LYING, [(0x1C, 3 << 3)], ACCELERATION, [2048, 0, -2048]),
        (still(temperature_c=21.0), [], TEMPERATURE, [0]),
        (still(temperature_c=25.0), [], TEMPERATURE, [1335]),
        (still(temperature_c=-10.0), [], TEMPERATURE, [-10350]),
        pytest.param(BEYOND, [], ACCELERATION, [32767, -32768, 32767], id="force saturates"),
        pytest.param(BEYOND, [], RATE, [32767, -32768, 0], id="rate saturates"),
        pytest.param(still(), [TEN_DPS_OFF], RATE, [1312, -1312, 0], id="offset in 250 dps"),
        pytest.param(still(), [TEN_DPS_OFF, (0x1B, 0x18)], RATE, [164, -164, 0], id="in 2000 dps"),
    ],
)
def test_words_follow_the_truth_by_range_and_offset(
    clock: ManualClock,
    inertia: Truth,
    settings: Sequence[Sequence[int]],
    register: int,
    words: list[int],
) -> None:
    rig = at_1_khz(clock, inertia, *settings)
    rig.wait(1)
    assert rig.words(register, len(words)) == words


def test_accelerometer_offset_moves_by_about_1_mg_a_step(clock: ManualClock) -> None:
    rig = at_1_khz(clock, still())
    high, low = rig.read(0x77, 2)
    moved = (high << 8 | low) + (100 << 1)  # 100 steps in bits 15:1, bit 0 kept
    rig.write(0x77, moved >> 8, moved & 0xFF)
    rig.wait(1)
    assert rig.words(ACCELERATION) == [1600, 0, 0]
    rig.write(0x1C, 0x18)
    rig.wait(1)
    assert rig.words(ACCELERATION) == [200, 0, 0]


def test_self_test_adds_the_factory_deflection_which_halves_with_each_range(
    clock: ManualClock,
) -> None:
    rig = at_1_khz(clock, still(), (0x1B, 0xE0), (0x1C, 0x40))
    rig.wait(1)
    gyro = [round(2620 * 1.01 ** (code - 1)) for code in rig.read(0x00, 3)]
    accelerometer = round(2620 * 1.01 ** (rig.read(0x0E)[0] - 1))
    assert rig.words(RATE) == gyro
    assert rig.words(ACCELERATION) == [0, accelerometer, 0]
    assert min(gyro) > 60 * 131
    assert 0.225 * 16384 < accelerometer < 0.675 * 16384
    rig.write(0x1B, 0x90)
    rig.wait(1)
    assert rig.words(RATE) == [round(2620 / 4 * 1.01 ** (rig.read(0x00)[0] - 1)), 0, 0]


# Filters

GYRO_DELAYS_MS = {1: 2.9, 2: 3.9, 3: 5.9, 4: 9.9, 5: 17.85, 6: 33.48}
FORCE_DELAYS_MS = {0: 1.88, 1: 1.88, 2: 2.88, 3: 4.88, 4: 8.87, 5: 16.83, 6: 32.48, 7: 1.38}
TEMPERATURE_DELAYS_MS = {1: 1.9, 2: 2.8, 3: 4.8, 4: 8.3, 5: 13.4, 6: 18.6}
"""By the code of the low-pass filter."""


@pytest.mark.parametrize(
    ("per_second", "register", "settings", "delay_ms"),
    [
        *((1000 * DPS, RATE, (0x1A, code, 0x18), delay) for code, delay in GYRO_DELAYS_MS.items()),
        pytest.param(1000 * DPS, RATE, (0x19, 9, 3, 0x18), 5.9, id="whatever the sample rate"),
        *((G, ACCELERATION, (0x1D, code), delay) for code, delay in FORCE_DELAYS_MS.items()),
    ],
)
def test_a_filter_delays_a_ramp_by_the_data_sheets_delay(
    clock: ManualClock, per_second: float, register: int, settings: Sequence[int], delay_ms: float
) -> None:
    rig = at_1_khz(clock, ramp(per_second), settings)
    rig.wait(1500)  # at 16.384 counts a ms: 1 g a second, or 1 dps a ms at 16.384 counts a dps
    assert rig.words(register)[0] == pytest.approx(16.384 * (1500 - delay_ms), abs=0.6)


def test_thermometer_can_be_stopped_alone_and_starts_again(clock: ManualClock) -> None:
    rig = at_1_khz(clock, still(rate=(0.0, 0.0, 1.0), temperature_c=25.0))
    rig.wait(100)
    for power, count in ((0x09, 0), (0x01, 1335)):  # PWR_MGMT_1: PD_PTAT
        rig.write(0x6B, power)
        rig.wait(10)
        assert rig.words(TEMPERATURE, 1) == [count]
        assert rig.words(RATE)[2] == pytest.approx(131 * 180 / math.pi, abs=10)


@pytest.mark.parametrize(
    ("settings", "delay_ms"),
    [
        *(((0x1A, code), delay) for code, delay in TEMPERATURE_DELAYS_MS.items()),
        pytest.param((0x1A, 6, 1), 0.04, id="none while the gyroscope's is bypassed"),
    ],
)
def test_temperature_has_a_filter_of_its_own(
    clock: ManualClock, settings: Sequence[int], delay_ms: float
) -> None:
    rig = at_1_khz(clock, ramp(10.0), settings)
    rig.wait(1500)
    expected = (10.0 * (1.5 - delay_ms / 1000) - 21.0) * 333.87
    assert rig.words(TEMPERATURE, 1)[0] == pytest.approx(expected, abs=0.6)


@pytest.mark.parametrize(
    ("bits", "started_over"),
    [(0x01, [TEMPERATURE]), (0x02, [ACCELERATION]), (0x04, [RATE]), (0x06, [ACCELERATION, RATE])],
)
def test_signal_path_reset_starts_the_filters_over_that_its_bits_name(
    clock: ManualClock, bits: int, started_over: list[int]
) -> None:
    rig = at_1_khz(clock, ramp(1000 * DPS), (0x1A, 6, 0x18, 0x18, 6))
    rig.wait(1500)
    rig.write(0x68, bits)
    rig.wait(1)
    value = 1.501 * 1000 * DPS
    unfiltered = {
        ACCELERATION: round(2048 * value / G),
        TEMPERATURE: round(333.87 * (value - 21.0)),
        RATE: round(16.384 * 1501),
    }
    words = {register: rig.words(register, 1)[0] for register in unfiltered}
    assert [each for each in words if words[each] == unfiltered[each]] == started_over


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
    rig = at_1_khz(clock, still(), (0x19, divider, config, gyro_config))
    start = clock()
    clock.advance(3 * period)
    rig.read(0x75)
    assert rig.asked[-3:] == [start + period, start + 2 * period, start + 3 * period]


def test_data_ready_is_set_by_a_sample_and_cleared_by_reading_it_or_any_if_anyrd_is_set(
    clock: ManualClock,
) -> None:
    rig = at_1_khz(clock, still(acceleration=(G, G, G)))
    rig.play("W 3a, R 00", "1 ms", "W 3a, R 01", "W 3a, R 00", "1 ms", "W 3b, R 40", "W 3a, R 01")
    rig.play("W 37 10", "1 ms", "W 3b, R 40", "W 3a, R 00")


def test_one_burst_holds_one_sample_and_the_next_transaction_another(clock: ManualClock) -> None:
    rig = at_1_khz(clock, ramp(1000 * DPS), (0x1A, 1, 0x18))
    rig.wait(100)
    before = rig.words(RATE)
    rig.chip.start(0x68, read=False)
    rig.chip.write(RATE)
    rig.wait(10)
    rig.chip.start(0x68, read=True)
    high, low = rig.chip.read(), rig.chip.read()
    rig.wait(10)
    rest = bytes([rig.chip.read() for _ in range(4)])
    rig.chip.stop()
    assert bytes([high, low]) + rest == before[0].to_bytes(2, "big") * 3
    assert rig.words(RATE)[0] > before[0] + 19 * 16


def test_range_changed_between_samples_takes_effect_with_the_next(clock: ManualClock) -> None:
    rig = at_1_khz(clock, still(acceleration=(G, 0.0, 0.0)))
    rig.play("1 ms", "W 1c 08", "W 3b, R 40 00", "1 ms", "W 3b, R 20 00")


def test_truth_is_asked_once_a_sample_in_order_of_time(clock: ManualClock) -> None:
    rig = at_1_khz(clock, still())
    rig.wait(10.5)
    rig.read(0x3A)
    rig.read(0x3A)
    rig.wait(2)
    rig.chip.catch_up()
    assert rig.asked == [n * UNITS["ms"] for n in range(1, 13)]
    assert rig.chip.samples == 12


def test_sig_cond_rst_clears_the_data_registers(clock: ManualClock) -> None:
    rig = at_1_khz(clock, still(acceleration=(G, G, G)))
    rig.play("1 ms", "W 6a 01", "W 3b, R 00*14", "1 ms", "W 3b, R 40 00 40 00 40 00")


MILLISECOND = 1_000_000


def wobble(at: int) -> InertialTruth:
    """Return a motion that never repeats."""
    s, c = math.sin(at * 1.7e-9), math.cos(at * 3.1e-9)
    return InertialTruth((s, c, 9.8), (c, s, s * c), (2e-5 * c, 2e-5 * s, 4e-5), 21.0 + s)


@pytest.mark.parametrize(
    "settings",
    [
        {0x1A: 0x06, 0x1D: 0x06},  # the slowest filters
        {0x1A: 0x01, 0x23: 0xF8, 0x6A: 0x40},  # FIFO overwriting, 14-byte packets
        {0x1A: 0x41, 0x23: 0x80, 0x6A: 0x40},  # FIFO stopping when full, 2-byte packets
        {0x1A: 0x01, 0x25: 0x8C, 0x26: 0x02, 0x27: 0x88, 0x6A: 0x20},  # AK8963 read each sample
        {0x1A: 0x01, 0x19: 0x04, 0x67: 0x01, 0x34: 0x07, 0x25: 0x8C, 0x27: 0x8A, 0x6A: 0x20},
        {0x1A: 0x01, 0x67: 0x10, 0x31: 0x8C, 0x32: 0x00, 0x34: 0x9F, 0x6A: 0x20},  # SLV4 once
        {0x1A: 0x01, 0x67: 0x01, 0x34: 0x1F, 0x25: 0x8D, 0x27: 0x81, 0x6A: 0x20},  # no chip there
        {0x1A: 0x01, 0x25: 0x8C, 0x26: 0x03, 0x27: 0x86, 0x23: 0x01, 0x6A: 0x60},  # AK8963 in FIFO
    ],
)
def test_long_silence_ends_in_the_same_bytes_for_bounded_work(settings: dict[int, int]) -> None:
    answers, samples = [], []
    for looks in (1, 8):
        clock = ManualClock()
        magnetometer = Ak8963Double(clock, lambda at: wobble(at).field, noise_seed=None)
        chip = Mpu9250Double(clock, wobble, magnetometer=magnetometer, noise_seed=None)
        bus = I2cBusDouble("i2c-1", clock, chip.targets)
        bus.write(0x68, b"\x37\x02")
        bus.write(0x0C, b"\x0a\x16")
        for register, content in settings.items():
            bus.write(0x68, bytes([register, content]))
        for _ in range(looks):
            clock.advance(8_000 * MILLISECOND // looks)
            chip.catch_up()
        answers.append(bus.write_read(0x68, b"\x36", 64) + bus.write_read(0x68, b"\x74", 512))
        samples.append(chip.samples)
    assert answers[0] == answers[1]
    assert samples[0] < 2_500
    assert samples[1] > samples[0]


def test_an_hour_of_silence_costs_what_the_slowest_filter_remembers(
    clock: ManualClock,
) -> None:
    asked: list[int] = []

    def inertia(at: int) -> InertialTruth:
        asked.append(at)
        return wobble(0)

    chip = Mpu9250Double(clock, inertia, noise_seed=None)
    I2cBusDouble("i2c-1", clock, chip.targets).write(0x68, b"\x1b\x01")
    clock.advance(3_600_000 * MILLISECOND)
    chip.catch_up()
    assert chip.samples == len(asked) == remembered(1 / 32)
    assert asked == sorted(asked)


def remembered(period_ms: float) -> int:
    """How many samples the accelerometer's lag of 1.88 ms takes to forget."""
    return math.ceil(math.log(2**53) / math.log(1 + period_ms / 1.88))


@pytest.mark.parametrize(
    ("settings", "first", "last"),
    [
        ({}, 0, 0),
        ({0x6A: 0x40}, 0, 0),  # a FIFO into which nothing goes
        ({0x6A: 0x20}, 32, 32),
        ({0x23: 0x08, 0x6A: 0x40}, 0, 512),
        ({0x23: 0x08, 0x6A: 0x60}, 32, 512),
        ({0x23: 0x08, 0x1A: 0x40, 0x6A: 0x40}, 512, 512),
    ],
)
def test_only_what_can_still_be_seen_is_simulated(
    clock: ManualClock, settings: dict[int, int], first: int, last: int
) -> None:
    """At 8 kHz, as after power-up."""
    chip = Mpu9250Double(clock, wobble, noise_seed=None)
    bus = I2cBusDouble("i2c-1", clock, chip.targets)
    for register, content in settings.items():
        bus.write(0x68, bytes([register, content]))
    clock.advance(10_000 * MILLISECOND)
    chip.catch_up()
    assert chip.samples == first + last + remembered(1 / 8)


def test_same_accesses_at_the_same_instants_give_the_same_bytes() -> None:
    runs = []
    for _ in range(2):
        clock = ManualClock()
        bus = I2cBusDouble("i2c-1", clock, [Mpu9250Double(clock, wobble, noise_seed=None)])
        answers = b""
        for step in range(50):
            clock.advance(300_000 * step)
            answers += bus.write_read(0x68, b"\x3a", 15)
        runs.append(answers)
    assert runs[0] == runs[1]
    assert len(set(runs[0])) > 100


@pytest.mark.parametrize(
    ("off", "moving", "turning"),
    [
        (0x00, (True, True, True), (True, True, True)),
        (0x38, (False, False, False), (True, True, True)),
        (0x07, (True, True, True), (False, False, False)),
        (0x20, (False, True, True), (True, True, True)),
        (0x08, (True, True, False), (True, True, True)),
        (0x04, (True, True, True), (False, True, True)),
        (0x11, (True, False, True), (True, True, False)),
    ],
)
def test_axes_are_stopped_one_by_one(
    clock: ManualClock, off: int, moving: tuple[bool, ...], turning: tuple[bool, ...]
) -> None:
    rig = at_1_khz(clock, still((G, G, G), (DPS, DPS, DPS)), (0x6C, off))  # PWR_MGMT_2
    rig.wait(100)
    assert tuple(word != 0 for word in rig.words(ACCELERATION)) == moving
    assert tuple(word != 0 for word in rig.words(RATE)) == turning
