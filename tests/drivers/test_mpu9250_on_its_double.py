from collections.abc import Callable
from typing import TypeAlias

import pytest
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.mpu9250_burst import InertialSample
from firmware_drivers.chips.mpu9250_settings import Mpu9250Settings

from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady
from sim_doubles.chips.ak8963 import Ak8963Double
from sim_doubles.chips.mpu9250 import Mpu9250Double
from sim_doubles.clock import ManualClock
from sim_doubles.faults import FaultScript, ForcedRegister
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.inertial_truth import InertialTruth
from tests.support.magnetometer import disable_magnetometer

Vector: TypeAlias = tuple[float, float, float]

MILLISECOND = 1_000_000
TICK = 10 * MILLISECOND


RATE_NOISE = 0.008
"""Six deviations of the data sheet's noise at 41 Hz, in rad/s."""


def growing(at: int) -> Vector:
    return (at * 1e-13, 20e-6 + at * 1e-13, -40e-6 - at * 1e-13)


class Bench:
    """One chip at rest in a field without noise that grows evenly: every measurement differs."""

    def __init__(
        self, settings: Mpu9250Settings | None = None, *, with_magnetometer: bool = True
    ) -> None:
        self.clock = ManualClock()
        self.field_now: Callable[[int], Vector] = growing
        self.magnetometer = Ak8963Double(self.clock, self.field, noise_seed=None)
        self.double = Mpu9250Double(
            self.clock, self.truth, magnetometer=self.magnetometer if with_magnetometer else None
        )
        targets = [self.double, self.magnetometer] if with_magnetometer else [self.double]
        self.bus = I2cBusDouble("i2c-1", self.clock, targets)
        self.chip = Mpu9250(self.bus, settings=settings)

    def field(self, at: int) -> Vector:
        return self.field_now(at)

    def truth(self, at: int) -> InertialTruth:
        return InertialTruth((0.0, 0.0, 9.80665), (0.1, 0.2, 0.3), self.field(at), 25.0)

    def bring_up(self) -> None:
        for step in self.chip.bring_up():
            step.action()
            self.clock.advance(step.wait_ns)

    def read_every(self, period: int, count: int) -> list[InertialSample]:
        samples = []
        for _ in range(count):
            self.clock.advance(period)
            samples.append(self.chip.read_sample())
        return samples


@pytest.mark.parametrize("sample_hz", [100, 125, 200, 250, 500, 1000])
@pytest.mark.parametrize("phase_ms", [0, 1, 4, 7])
def test_a_reader_at_100_hz_misses_no_sample_and_hardly_a_field(
    sample_hz: int, phase_ms: int
) -> None:
    bench = Bench(Mpu9250Settings(sample_hz=sample_hz))
    bench.bring_up()
    bench.clock.advance(phase_ms * MILLISECOND)
    samples = bench.read_every(TICK, 200)
    fields = [sample.field for sample in samples if sample.field is not None]
    assert len(fields) >= 198
    fetch = Mpu9250Settings(sample_hz=sample_hz).samples_a_fetch() / sample_hz
    assert len(set(fields)) >= min(1.0, 0.01 / fetch) * 200 - 2


@pytest.mark.parametrize("drift_ns", [-90_000, -7_000, 7_000, 90_000])
def test_clocks_that_drift_cost_a_field_now_and_then_and_never_run_backwards(
    drift_ns: int,
) -> None:
    bench = Bench()
    bench.bring_up()
    samples = bench.read_every(TICK + drift_ns, 500)
    fields = [sample.field[0] for sample in samples if sample.field is not None]
    assert len(fields) >= 490
    assert fields == sorted(fields)
    assert len(set(fields)) >= 490


def test_a_second_read_within_one_sample_is_refused(bench: Bench) -> None:
    bench.bring_up()
    bench.read_every(TICK, 1)
    with pytest.raises(NotReady, match="expected a new sample"):
        bench.chip.read_sample()
    bench.read_every(TICK, 1)


def test_a_magnetometer_that_dies_is_seen_to_stand_still(bench: Bench) -> None:
    bench.bring_up()
    bench.read_every(TICK, 10)
    assert bench.chip.stuck_field is None
    assert bench.chip.check_magnetometer()
    disable_magnetometer(bench.bus)
    assert bench.read_every(TICK, 50)[-1].field is None
    assert bench.chip.stuck_field is not None
    assert not bench.chip.check_magnetometer()


def test_a_field_that_stands_still_is_none_until_a_bit_changes(bench: Bench) -> None:
    """What a hanging auxiliary bus looks like: the last fetch stands, and nothing refuses."""
    bench.bring_up()
    assert bench.read_every(TICK, 20)[-1].field is not None
    hung = FaultScript(
        [
            ForcedRegister(address=0x68, register=0x49 + place, value=value, first=0, times=None)
            for place, value in enumerate((0x01, 7, 0, 8, 0, 9, 0, 0x10))
        ]
    )
    bench.bus.faults = hung
    samples = bench.read_every(TICK, 60)
    assert samples[10].field is not None
    assert samples[-1].field is None
    assert bench.chip.stuck_field is not None
    assert bench.chip.stuck_field.axis == "field x, field y, field z"
    bench.bus.faults = FaultScript([])
    assert bench.read_every(TICK, 2)[-1].field is not None
    assert bench.chip.stuck_field is None


def test_a_field_beyond_range_is_flagged_and_comes_back(bench: Bench) -> None:
    bench.bring_up()
    bench.field_now = lambda _: (3000e-6, 2000e-6, 0.0)
    strong = bench.read_every(TICK, 3)[-1]
    assert strong.field is None
    assert strong.field_overflow
    bench.field_now = lambda _: (30e-6, 20e-6, 0.0)
    weak = bench.read_every(TICK, 3)[-1]
    assert weak.field == pytest.approx((30e-6, 20e-6, 0.0), abs=0.15e-6)
    assert not weak.field_overflow


def test_without_magnetometer_the_other_six_axes_are_right() -> None:
    bench = Bench(with_magnetometer=False)
    bench.bring_up()
    sample = bench.read_every(TICK, 50)[-1]
    assert not bench.chip.has_magnetometer
    assert "six axes only" in bench.chip.warnings[0]
    assert sample.field is None
    assert sample.acceleration == pytest.approx((0.0, 0.0, 9.80665), abs=0.15)
    assert sample.rate == pytest.approx((0.1, 0.2, 0.3), abs=RATE_NOISE)


@pytest.mark.parametrize("with_magnetometer", [True, False])
def test_after_a_brown_out_there_is_no_sample_until_bring_up(*, with_magnetometer: bool) -> None:
    bench = Bench(with_magnetometer=with_magnetometer)
    bench.bring_up()
    bench.read_every(TICK, 5)
    bench.bus.power_cycle()
    for _ in range(20):
        bench.clock.advance(TICK)
        with pytest.raises((NoAcknowledge, NotReady)):  # at first it does not even answer
            bench.chip.read_sample()
    bench.bring_up()
    assert bench.read_every(TICK, 50)[-1].rate == pytest.approx((0.1, 0.2, 0.3), abs=RATE_NOISE)


def test_mounting_turns_the_world_into_the_body() -> None:
    bench = Bench(Mpu9250Settings(mounting="-y +x +z"))
    bench.bring_up()
    bench.field_now = lambda _: (30e-6, 20e-6, -40e-6)
    sample = bench.read_every(TICK, 10)[-1]
    assert sample.rate == pytest.approx((-0.2, 0.1, 0.3), abs=RATE_NOISE)
    assert sample.field == pytest.approx((-20e-6, 30e-6, -40e-6), abs=0.15e-6)


@pytest.fixture
def bench() -> Bench:
    return Bench()
