import math

import pytest
from firmware_boards.tachobot.attitude import FIELDS_AVERAGED, Attitude
from firmware_drivers.chips.mpu9250_burst import InertialSample

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.models.motion import Motion

FIELD_T = 20e-6


class Rig:
    """An attitude estimator alone; samples come in by hand."""

    def __init__(self, *, compass_s: float = 0.0, enabled: bool = True) -> None:
        top = Coupled("top")
        model = top.add(Attitude("attitude", round(compass_s * SECOND), enabled=enabled))
        self.sample, self.enable = top.in_port("sample", InertialSample), top.in_port("on", bool)
        top.couple(self.sample, model.sample)
        top.couple(self.enable, model.enable)
        self.simulator = Simulator(top, checked=True)
        self.motions: list[Motion] = []
        self.simulator.listen(model.yaw, lambda _at, motion: self.motions.append(motion))

    def feel(self, at_ms: int, rate: float, heading: float | None = None) -> None:
        """A sample at that instant; `heading` is how far the body has turned from north."""
        field = None
        if heading is not None:
            field = (FIELD_T * math.cos(heading), -FIELD_T * math.sin(heading), -40e-6)
        sample = InertialSample(
            (0.0, 0.0, 9.8), (0.0, 0.0, rate), field, 25.0, field_overflow=False
        )
        self.simulator.inject(self.sample, sample)
        self.simulator.advance(at_ms * MILLISECOND)

    @property
    def yaw(self) -> float:
        return self.motions[-1].position


def test_yaw_is_zero_where_the_first_sample_finds_the_robot() -> None:
    rig = Rig()
    rig.feel(100, 0.3)
    assert rig.motions == [Motion(0.0, 0.3)]


def test_rates_are_integrated_by_the_trapezoid_rule_over_the_true_time() -> None:
    rig = Rig()
    rig.feel(0, 0.0)
    rig.feel(100, 1.0)
    rig.feel(300, 1.0)
    assert rig.yaw == pytest.approx(0.05 + 0.2)


def test_the_compass_pulls_the_estimate_to_the_angle_turned_since_its_first_field() -> None:
    rig = Rig(compass_s=1.0)
    for n in range(1101):
        rig.feel(10 * n, 0.0, heading=2.0 if n <= FIELDS_AVERAGED else 2.5)
    assert rig.yaw == pytest.approx(0.5, abs=1e-3)


def test_the_compass_angle_at_the_start_is_the_mean_of_its_first_fields() -> None:
    rig = Rig(compass_s=1.0)
    for n in range(1101):
        rig.feel(10 * n, 0.0, heading=1.0 + (-1) ** n * 0.1 if n <= FIELDS_AVERAGED else 1.0)
    assert rig.yaw == pytest.approx(0.0, abs=1e-3)


def test_the_compass_takes_the_short_way_round() -> None:
    rig = Rig(compass_s=1.0)
    for n in range(FIELDS_AVERAGED + 1):
        rig.feel(10 * n, 0.0, heading=math.pi - 0.1)
    rig.feel(10 * FIELDS_AVERAGED + 10, 0.0, heading=-math.pi + 0.1)
    assert rig.yaw == pytest.approx(0.2 * 0.01)


def test_without_a_field_or_a_time_constant_the_gyro_stands_alone() -> None:
    rig = Rig(compass_s=0.0)
    rig.feel(0, 0.0, heading=0.0)
    rig.feel(10, 0.0, heading=1.0)
    assert rig.yaw == 0.0


def test_a_disabled_estimator_says_nothing_until_it_is_enabled() -> None:
    rig = Rig(enabled=False)
    rig.feel(0, 1.0)
    assert rig.motions == []
    rig.simulator.inject(rig.enable, True)
    rig.simulator.advance(5 * MILLISECOND)
    rig.feel(10, 1.0)
    assert rig.motions == [Motion(0.0, 1.0)]
