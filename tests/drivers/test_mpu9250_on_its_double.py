"""Drivers of the MPU-9250 and of the AK8963 in it, in motion and on bare registers."""

import re
import struct

import pytest
from firmware_drivers.chips.ak8963 import Ak8963
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.mpu9250_burst import InertialSample
from firmware_drivers.chips.mpu9250_settings import Mpu9250Settings

from firmware_runtime.hal.i2c import Message
from firmware_runtime.hal.wire_errors import Implausible, NoAcknowledge, NotReady
from sim_doubles.clock import ManualClock
from sim_doubles.faults import FaultScript, ForcedRegister
from sim_doubles.inertial_truth import InertialTruth
from tests.support.bare_chip import BareChip
from tests.support.magnetometer import Vector, WiredMpu9250, disable_magnetometer

MILLISECOND = 1_000_000
TICK = 10 * MILLISECOND


RATE = (0.1, 0.2, 0.3)


def growing(at: int) -> Vector:
    return (at * 1e-13, 20e-6 + at * 1e-13, -40e-6 - at * 1e-13)


class Rig(WiredMpu9250):
    """One chip at rest in a field without noise that grows evenly: every measurement differs."""

    def __init__(self, settings: Mpu9250Settings | None = None) -> None:
        self.rate = RATE
        super().__init__(ManualClock(), self.truth, magnetometer=True, noise_seed=1)
        self.driver = Mpu9250(self.bus, settings=settings)
        self.bring_up()

    def _field(self, at: int) -> Vector:
        return growing(at)

    def truth(self, at: int) -> InertialTruth:
        return InertialTruth((0.0, 0.0, 9.80665), self.rate, self._field(at), 25.0)

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


@pytest.mark.parametrize("turned", [60.0, -60.0])
def test_what_turns_faster_than_can_be_measured_is_no_rate(rig: Rig, turned: float) -> None:
    rig.rate = (0.0, 0.0, turned)
    with pytest.raises(Implausible, match=r"rate z is -?3\.277e\+04, expected less than the whole"):
        rig.read_every(TICK, 10)
    rig.rate = RATE
    rig.clock.advance(10 * TICK)  # the low-pass forgets
    assert rig.driver.read_sample().rate == pytest.approx(RATE, abs=0.05)


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


@pytest.mark.parametrize(
    ("register", "value", "reason"),
    [
        pytest.param(0x49, 0x00, "field data ready reads 0 in 65 readings", id="never new"),
        pytest.param(0x50, 0x18, "field overflow reads 1 in 65 .*4912 uT", id="beyond its range"),
        pytest.param(0x50, 0x00, "field data ready reads 1 .*16 bits", id="of 14 bits"),
    ],
)
def test_a_field_that_never_comes_is_said_to_be_stuck_until_one_comes(
    rig: Rig, register: int, value: int, reason: str
) -> None:
    """An auxiliary bus may hang with a fetch that found nothing new: then nothing repeats."""
    rig.bus.faults = FaultScript(
        [ForcedRegister(address=0x68, register=register, value=value, first=0, times=None)]
    )
    assert all(sample.field is None for sample in rig.read_every(TICK, 64))
    assert rig.driver.stuck_field is None
    rig.read_every(TICK, 1)
    assert re.search(reason, str(rig.driver.stuck_field))
    rig.bus.faults = FaultScript([])
    assert rig.read_every(TICK, 2)[-1].field is not None
    assert rig.driver.stuck_field is None


Bare = BareChip[Ak8963]


@pytest.fixture
def bare() -> Bare:
    return BareChip(Ak8963, 0x0C, {0x00: b"\x48", 0x10: bytes((176, 128, 0))})


def test_modes_change_by_way_of_power_down_with_a_wait(bare: Bare) -> None:
    waits: dict[Message, int] = {}
    for step in bare.driver.bring_up():
        bare.bus.wire.clear()
        step.action()
        waits |= dict.fromkeys(bare.written, step.wait_ns)
    assert list(waits) == [b"\x0b\x01", b"\x0a\x0f", b"\x0a\x00", b"\x0a\x16"]
    assert all(wait >= 100_000 for wait in waits.values())
    assert waits[b"\x0a\x16"] >= 9_000_000


def test_sensitivity_is_read_in_fuse_rom_mode_and_halved_to_doubled_by_it(bare: Bare) -> None:
    bare.bring_up()
    fuse, power_down = (bare.sent.index((sent,)) for sent in (b"\x0a\x0f", b"\x0a\x00"))
    assert fuse < bare.sent.index((b"\x10", 3)) < power_down
    assert bare.driver.sensitivity == pytest.approx((0.15e-6 * 1.1875, 0.15e-6, 0.075e-6))


@pytest.mark.parametrize("fuse", [b"\x00\x00\x00", b"\xff\xff\xff"])
def test_a_fuse_rom_that_reads_one_level_is_a_fault(bare: Bare, fuse: bytes) -> None:
    bare.hold({0x10: fuse})
    with pytest.raises(NotReady, match=rf"fuse ROM reads {fuse.hex(' ')}; expected"):
        bare.bring_up()


def test_no_answer_hints_at_bypass(bare: Bare) -> None:
    with bare.silent(), pytest.raises(NoAcknowledge, match="bypass"):
        bare.bring_up()


def test_a_measurement_is_read_to_st2_and_given_in_tesla(bare: Bare) -> None:
    bare.bring_up()
    bare.hold({0x02: struct.pack("<B3hB", 0x01, 400, -32760, 3, 0x10)})
    assert bare.driver.read_field() == pytest.approx((71.25e-6, -4914e-6, 0.225e-6))
    assert bare.sent[-1] == (b"\x02", 8)


@pytest.mark.parametrize(
    ("st1", "st2", "reason"),
    [
        (0x00, 0x10, "no new measurement; expected 100 a second"),
        (0x01, 0x18, "ST2 reads 18; expected 10"),
        (0x01, 0x00, "ST2 reads 00; expected 10"),
    ],
)
def test_a_measurement_that_is_old_or_invalid_is_not_given(
    bare: Bare, st1: int, st2: int, reason: str
) -> None:
    bare.bring_up()
    bare.hold({0x02: struct.pack("<B3hB", st1, 1, 2, 3, st2)})
    with pytest.raises(NotReady, match=reason):
        bare.driver.read_field()
