import pytest
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.mpu9250_burst import InertialSample
from firmware_drivers.chips.mpu9250_settings import Mpu9250Settings

from firmware_runtime.hal.wire_errors import NotReady
from sim_doubles.clock import ManualClock
from sim_doubles.faults import FaultScript, ForcedRegister
from sim_doubles.inertial_truth import InertialTruth
from tests.support.magnetometer import Vector, WiredMpu9250, disable_magnetometer

MILLISECOND = 1_000_000
TICK = 10 * MILLISECOND


RATE = (0.1, 0.2, 0.3)


def growing(at: int) -> Vector:
    return (at * 1e-13, 20e-6 + at * 1e-13, -40e-6 - at * 1e-13)


class Rig(WiredMpu9250):
    """One chip at rest in a field without noise that grows evenly: every measurement differs."""

    def __init__(self, settings: Mpu9250Settings | None = None) -> None:
        super().__init__(ManualClock(), self.truth, magnetometer=True, noise_seed=1)
        self.driver = Mpu9250(self.bus, settings=settings)
        self.bring_up()

    def _field(self, at: int) -> Vector:
        return growing(at)

    def truth(self, at: int) -> InertialTruth:
        return InertialTruth((0.0, 0.0, 9.80665), RATE, self._field(at), 25.0)

    def bring_up(self) -> None:
        self.take(self.driver.bring_up())

    def read_every(self, period: int, count: int) -> list[InertialSample]:
        samples = []
        for _ in range(count):
            self.clock.advance(period)
            samples.append(self.driver.read_sample())
        return samples


@pytest.fixture
def rig() -> Rig:
    return Rig()


@pytest.mark.parametrize("sample_hz", [100, 125, 200, 250, 500, 1000])
@pytest.mark.parametrize("phase_ms", [0, 1, 4, 7])
def test_a_reader_at_100_hz_misses_no_sample_and_hardly_a_field(
    sample_hz: int, phase_ms: int
) -> None:
    rig = Rig(Mpu9250Settings(sample_hz=sample_hz))
    rig.clock.advance(phase_ms * MILLISECOND)
    samples = rig.read_every(TICK, 200)
    fields = [sample.field for sample in samples if sample.field is not None]
    assert len(fields) >= 198
    fetch = Mpu9250Settings(sample_hz=sample_hz).samples_a_fetch() / sample_hz
    assert len(set(fields)) >= min(1.0, 0.01 / fetch) * 200 - 2


@pytest.mark.parametrize("drift_ns", [-90_000, -7_000, 7_000, 90_000])
def test_clocks_that_drift_cost_a_field_now_and_then_and_never_run_backwards(
    drift_ns: int,
) -> None:
    rig = Rig()
    samples = rig.read_every(TICK + drift_ns, 500)
    fields = [sample.field[0] for sample in samples if sample.field is not None]
    assert len(fields) >= 490
    assert fields == sorted(fields)
    assert len(set(fields)) >= 490


def test_a_second_read_within_one_sample_is_refused(rig: Rig) -> None:
    rig.read_every(TICK, 1)
    with pytest.raises(NotReady, match="expected a new sample"):
        rig.driver.read_sample()
    rig.read_every(TICK, 1)


def test_a_magnetometer_that_dies_is_seen_to_stand_still(rig: Rig) -> None:
    rig.read_every(TICK, 10)
    assert rig.driver.stuck_field is None
    assert rig.driver.check_magnetometer()
    disable_magnetometer(rig.bus)
    assert rig.read_every(TICK, 50)[-1].field is None
    assert rig.driver.stuck_field is not None
    assert not rig.driver.check_magnetometer()


def test_a_field_that_stands_still_is_none_until_a_bit_changes(rig: Rig) -> None:
    """What a hanging auxiliary bus looks like: the last fetch stands, and nothing refuses."""
    assert rig.read_every(TICK, 20)[-1].field is not None
    hung = FaultScript(
        [
            ForcedRegister(address=0x68, register=0x49 + place, value=value, first=0, times=None)
            for place, value in enumerate((0x01, 7, 0, 8, 0, 9, 0, 0x10))
        ]
    )
    rig.bus.faults = hung
    samples = rig.read_every(TICK, 60)
    assert samples[10].field is not None
    assert samples[-1].field is None
    assert rig.driver.stuck_field is not None
    assert rig.driver.stuck_field.axis == "field x, field y, field z"
    rig.bus.faults = FaultScript([])
    assert rig.read_every(TICK, 2)[-1].field is not None
    assert rig.driver.stuck_field is None
