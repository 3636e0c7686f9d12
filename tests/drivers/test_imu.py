"""The IMU's model over a chip that answers as scripted: stages, bias, faults, a lost chip."""

from typing import Any, ClassVar, cast

import pytest
from firmware_drivers.chips.mounting import Vector
from firmware_drivers.chips.mpu9250 import Mpu9250
from firmware_drivers.chips.mpu9250_burst import InertialSample
from firmware_drivers.chips.mpu9250_settings import Mpu9250Settings
from firmware_drivers.chips.step import Step
from firmware_drivers.gyro_bias import GyroBias
from firmware_drivers.hardware import RETRY_AFTER
from firmware_drivers.imu import FAULTS_BEFORE_BRING_UP, Imu

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import HalError, Implausible, Stuck
from tests.support.scripted_bench import ScriptedBench
from tests.support.scripted_chip import SILENT, ScriptedChip
from tests.support.wire import sentences

PERIOD_MS = 10
SAMPLES = 4
"""Of the bias."""
BEGUN_MS = 20
"""The one step of the bring-up waits for 15 ms: two periods."""
READY_MS = BEGUN_MS + PERIOD_MS * SAMPLES
"""When the sample comes that completes the bias; the one after is the first to be sent."""


def sample(z: float = 0.02) -> InertialSample:
    return InertialSample((0.0, 0.0, 9.8), (0.01, -0.01, z), None, 21.0, field_overflow=False)


class ScriptedMpu9250(ScriptedChip):
    def __init__(self) -> None:
        super().__init__()
        self.settings = Mpu9250Settings(sample_hz=200)
        self.place = "MPU-9250 at 0x68 on i2c1"
        self.steps: list[HalError | None] = [None]
        self.readings: list[InertialSample | HalError] = [sample()]
        self.warnings: list[str] = []
        self.stuck_field: Stuck | None = None
        self.is_magnetometer_alive = True

    def read_every(self, period_ns: int) -> None:
        self.period_ns = period_ns

    def bring_up(self) -> tuple[Step, ...]:
        wait = 15 * MILLISECOND
        return (Step("identify", lambda: self.answer("step", self.steps), wait),)

    def read_sample(self, rate_bias: Vector) -> InertialSample:
        sample = self.answer("read", self.readings)
        x, y, z = (rate - bias for rate, bias in zip(sample.rate, rate_bias, strict=True))
        return sample._replace(rate=(x, y, z))

    def check_magnetometer(self) -> bool:
        self.answer("check", [None])
        return self.is_magnetometer_alive


class Rig(ScriptedBench[ScriptedMpu9250]):
    good: ClassVar = {"readings": sample()}

    """The model, its chip, and what it said."""

    def __init__(self) -> None:
        chip, bias = ScriptedMpu9250(), GyroBias(SAMPLES, max_spread=0.05)
        self.imu = Imu("imu", cast("Mpu9250", chip), PERIOD_MS * MILLISECOND, bias)
        super().__init__(self.imu, chip)

    @property
    def samples(self) -> list[tuple[float, Any]]:
        return self.said["sample"]

    def fail(self, times: int) -> None:
        """Let the next reads fail, so many times, and then answer again."""
        self.chip.readings = [*[SILENT] * times, sample()]

    def later(self, periods: int) -> None:
        """Run until so many periods after the bias was complete."""
        self.run(READY_MS + periods * PERIOD_MS)

    @property
    def sent(self) -> list[float]:
        return [at_ms for at_ms, _ in self.samples]

    @property
    def unready(self) -> str:
        return self.imu.unready() or ""


@pytest.fixture
def rig() -> Rig:
    return Rig()


@pytest.fixture
def ready(rig: Rig) -> Rig:
    """One that has sent its first sample."""
    rig.run(READY_MS)
    return rig


def test_it_is_brought_up_at_once_and_a_steps_wait_lets_whole_periods_pass(rig: Rig) -> None:
    rig.run(BEGUN_MS + PERIOD_MS)
    assert rig.chip.calls == [("step", 0.0), ("read", BEGUN_MS + PERIOD_MS)]


def test_the_bias_is_measured_first_and_nothing_is_sent_meanwhile(rig: Rig) -> None:
    rig.chip.readings = [sample(0.02), sample(0.04), sample(0.02), sample(0.04), sample(0.5)]
    rig.run(READY_MS)
    assert (rig.samples, rig.imu.phase) == ([], "sampling")
    assert rig.imu.bias == pytest.approx((0.01, -0.01, 0.03))
    rig.run(READY_MS + PERIOD_MS)
    ((at, first),) = rig.samples
    rate: Vector = first.rate
    assert at == READY_MS + PERIOD_MS
    assert rate == pytest.approx((0.0, 0.0, 0.47))
    assert first.acceleration == (0.0, 0.0, 9.8)


def test_a_robot_that_moved_is_measured_again_and_that_is_said(rig: Rig) -> None:
    rig.chip.readings = [sample(0.0), sample(0.4), sample(0.0), sample(0.4), sample(0.02)]
    rig.run(READY_MS)
    assert "the robot moved" in rig.faults[0].reason
    assert rig.samples == []
    assert "the robot moved" in (rig.imu.unready() or "")
    rig.run(READY_MS + SAMPLES * PERIOD_MS)
    assert (len(rig.faults), rig.imu.unready()) == (1, None)
    assert rig.imu.bias == pytest.approx((0.01, -0.01, 0.02))


@sentences(
    {
        "there is one sample a period": "110; sent is 70 80 90 100 110; consecutive is ()",
        "a read that fails is a fault and no sample": (
            "readings xx.; 100; consecutive is 1 2; sent is 90 100; readings x.; 110; "
            "consecutive is 1 2 1"
        ),
        "it says why there are no samples": (
            "unready is (); readings x; 70; unready is has failed; 90; "
            "unready is has failed 3 times in a row"
        ),
    }
)
def test_one_that_is_ready(ready: Rig, lines: str) -> None:
    ready.play(lines)


def test_a_chip_that_failed_often_enough_in_a_row_is_brought_up_again_and_the_bias_outlives_it(
    ready: Rig,
) -> None:
    ready.fail(FAULTS_BEFORE_BRING_UP)
    ready.later(FAULTS_BEFORE_BRING_UP)
    assert ready.chip.times("step") == [0.0]
    ready.later(FAULTS_BEFORE_BRING_UP + 20)
    _, again_at = ready.chip.times("step")
    assert again_at <= READY_MS + (FAULTS_BEFORE_BRING_UP + 1) * PERIOD_MS
    (first_at, first), *_ = ready.samples
    assert first_at == again_at + BEGUN_MS + PERIOD_MS
    assert first.rate == pytest.approx((0.0, 0.0, 0.0))


def test_failures_that_a_good_read_interrupts_bring_nothing_up(ready: Rig) -> None:
    almost = [SILENT] * (FAULTS_BEFORE_BRING_UP - 1)
    ready.chip.readings = [*almost, sample(), *almost, sample()]
    ready.later(2 * FAULTS_BEFORE_BRING_UP)
    assert ready.chip.times("step") == [0.0]


def test_a_bring_up_that_fails_is_begun_again_after_a_while(rig: Rig) -> None:
    rig.chip.steps = [SILENT, SILENT, None]
    rig.run(300)
    wait_ms = RETRY_AFTER / MILLISECOND
    assert rig.chip.times("step") == [0.0, wait_ms, 2 * wait_ms]
    assert [fault.consecutive for fault in rig.faults] == [1, 2]
    assert rig.samples


def test_what_a_bring_up_warns_of_is_said_once_and_samples_come(rig: Rig) -> None:
    rig.chip.warnings.append("six axes only")
    rig.run(READY_MS + 2 * PERIOD_MS)
    assert [(at, fault.reason) for at, fault in rig.said["fault"]] == [(BEGUN_MS, "six axes only")]
    assert rig.sent == [READY_MS + PERIOD_MS, READY_MS + 2 * PERIOD_MS]


STUCK_FIELD = Stuck("MPU-9250", "field x", 7, 50)


def test_a_magnetometer_that_died_is_reported_once_and_samples_go_on(ready: Rig) -> None:
    ready.later(1)
    assert ready.chip.times("check") == []
    ready.chip.stuck_field = STUCK_FIELD
    ready.chip.is_magnetometer_alive = False
    ready.later(4)
    (fault,) = ready.faults
    assert fault.kind == "Warning"
    assert fault.reason.startswith("MPU-9250 at 0x68 on i2c1: six axes only, without field")
    assert len(ready.samples) == 4


def test_a_field_that_stands_still_is_a_fault_each_time_it_begins(ready: Rig) -> None:
    ready.chip.stuck_field = STUCK_FIELD
    ready.later(3)
    ready.chip.stuck_field = None
    ready.later(5)
    ready.chip.stuck_field = STUCK_FIELD
    ready.later(7)
    assert [(fault.kind, fault.duration) for fault in ready.faults] == [
        ("Stuck", 50 * PERIOD_MS * MILLISECOND)
    ] * 2
    assert len(ready.samples) == 7


def test_a_gyro_that_is_dead_sends_no_sample_and_one_that_lives_again_does(ready: Rig) -> None:
    dead = Implausible("MPU-9250", "rate z", 9.0, "less", readings=3)
    ready.chip.readings = [dead, sample()]
    ready.later(2)
    (fault,) = ready.faults
    assert (fault.kind, fault.axis, fault.value) == ("Implausible", "rate z", 9.0)
    assert fault.duration == 3 * PERIOD_MS * MILLISECOND
    assert ready.sent == [READY_MS + 2 * PERIOD_MS]


def test_before_it_is_ready_it_says_why_there_are_no_samples(rig: Rig) -> None:
    rig.play("0; unready is is not up yet; 20; unready is is not calibrated yet; 60; unready is ()")


def test_a_chip_that_samples_more_slowly_than_it_is_read_is_refused() -> None:
    chip = ScriptedMpu9250()
    chip.settings = Mpu9250Settings(sample_hz=100)
    bias = GyroBias(SAMPLES, max_spread=0.05)
    Imu("imu", cast("Mpu9250", chip), 10 * MILLISECOND, bias)
    with pytest.raises(SettingError, match=r"i2c1: sample_hz: 100; expected more than 200"):
        Imu("imu", cast("Mpu9250", chip), 5 * MILLISECOND, bias)
