"""MPU-9250 double, not read for long: the work stays bounded and the bytes the same."""

import math

import pytest

from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.clock import ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.inertial_truth import InertialTruth

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
