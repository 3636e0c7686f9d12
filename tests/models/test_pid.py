import math

import pytest

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.models.motion import Motion, Setpoint
from firmware_runtime.models.pid import Pid, PidGains, TrackingPid
from tests.support.atomic_bench import AtomicBench


class Loop(AtomicBench):
    """A controller alone, fed from outside."""

    def __init__(self, pid: Pid | TrackingPid) -> None:
        super().__init__(pid)
        self.pid = pid

    def measure(self, at_ms: int, position: float, rate: float = 0.0) -> None:
        self.meet(at_ms, measurement=Motion(position, rate))

    @property
    def commands(self) -> list[float]:
        return self.values("command_n")


class Referred(Loop):
    """A PID that has a reference."""

    def __init__(self, gains: PidGains, reference: float = 1.0) -> None:
        super().__init__(Pid("pid", gains, reference))

    def answer(self, at_ms: int, position: float, rate: float = 0.0) -> float:
        """Return the command to a measurement."""
        self.measure(at_ms, position, rate)
        return self.commands[-1]

    def refer(self, at_ms: int, reference: float) -> None:
        self.meet(at_ms, reference=reference)


def gains(**changes: float) -> PidGains:
    return PidGains(**{"kp": 0.0, "ki": 0.0, "kd": 0.0, "limit": 10.0, **changes})  # type: ignore[arg-type]


def test_the_proportional_part_is_gain_times_error() -> None:
    assert Referred(gains(kp=2.0)).answer(0, 0.25) == pytest.approx(1.5)


def test_the_derivative_acts_on_the_measured_rate_and_not_on_the_reference() -> None:
    loop = Referred(gains(kd=3.0))
    assert loop.answer(0, 0.0, rate=0.5) == pytest.approx(-1.5)
    loop.refer(5, 100.0)
    assert loop.answer(10, 0.0, rate=0.5) == pytest.approx(-1.5)


def test_the_integral_uses_the_time_that_passed_between_measurements() -> None:
    loop = Referred(gains(ki=1.0))
    assert loop.answer(500, 0.0) == 0.0
    assert loop.answer(600, 0.0) == pytest.approx(0.1)
    assert loop.answer(1600, 0.5) == pytest.approx(0.6)


def test_a_reference_in_between_does_not_cut_the_integration_time_short() -> None:
    loop = Referred(gains(ki=1.0))
    loop.answer(0, 0.0)
    loop.refer(40, 1.0)
    assert loop.answer(100, 0.0) == pytest.approx(0.1)


def test_the_command_stays_within_its_limit() -> None:
    loop = Referred(gains(kp=100.0, limit=0.8))
    assert loop.answer(0, 0.0) == 0.8
    assert loop.answer(10, 2.0) == -0.8


@pytest.mark.parametrize(("anti_windup", "integral"), [(True, 0.0), (False, 2.0)])
def test_anti_windup_freezes_the_integral_at_the_limit(
    anti_windup: bool,  # noqa: FBT001 -- a parameter of the test
    integral: float,
) -> None:
    loop = Referred(PidGains(kp=5.0, ki=1.0, kd=0.0, limit=1.0, anti_windup=anti_windup))
    loop.answer(0, 0.0)
    loop.answer(2000, 0.0)
    assert loop.pid.integral_n == pytest.approx(integral)


def test_anti_windup_lets_the_integral_leave_the_limit() -> None:
    loop = Referred(PidGains(kp=5.0, ki=1.0, kd=0.0, limit=1.0))
    loop.pid.integral_n = 3.0
    loop.answer(0, 0.0)
    loop.answer(1000, 1.5)
    assert loop.pid.integral_n == pytest.approx(2.5)


@pytest.mark.parametrize("reference", [math.nan, math.inf])
def test_a_reference_that_is_not_finite_is_ignored(reference: float) -> None:
    loop = Referred(gains(kp=1.0))
    loop.refer(0, reference)
    assert loop.answer(10, 0.0) == 1.0


# With a setpoint ----------------------------------------------------------------------------------


def tracking(inertia: float = 0.0, **changes: float) -> Loop:
    return Loop(TrackingPid("pid", gains(**changes), inertia, 200 * MILLISECOND))


def put(loop: Loop, at_ms: int, setpoint: Setpoint) -> None:
    loop.meet(at_ms, setpoint=setpoint)


def test_without_a_setpoint_a_measurement_has_no_answer() -> None:
    loop = tracking(kp=1.0)
    loop.measure(10, 1.0)
    assert loop.commands == []


def test_the_setpoints_acceleration_is_fed_forward() -> None:
    loop = tracking(inertia=3.0)
    put(loop, 10, Setpoint(0.0, 0.0, 0.2))
    loop.measure(10, 5.0)
    assert loop.commands == [pytest.approx(0.6)]


def test_the_derivative_acts_on_the_difference_of_the_rates() -> None:
    loop = tracking(kd=2.0)
    put(loop, 10, Setpoint(0.0, 0.5, 0.2))
    loop.measure(10, 0.0, rate=0.2)
    loop.measure(110, 0.0, rate=0.2)
    assert loop.commands == [pytest.approx(0.6), pytest.approx(0.64)]


def test_a_setpoint_goes_on_with_its_rate_and_acceleration_until_the_next() -> None:
    loop = tracking(kp=1.0)
    put(loop, 10, Setpoint(1.0, 0.5, 0.2))
    loop.measure(110, 0.0)
    assert loop.commands == [pytest.approx(1.0 + 0.05 + 0.001)]


def test_a_setpoint_that_is_too_old_is_none() -> None:
    loop = tracking(kp=1.0)
    put(loop, 10, Setpoint(1.0, 0.0, 0.0))
    loop.measure(210, 0.0)
    loop.measure(211, 0.0)
    assert len(loop.commands) == 1


def test_time_without_a_setpoint_is_not_integrated() -> None:
    loop = tracking(ki=1.0)
    for at_ms in (10, 500):
        loop.measure(at_ms, 0.0)
    put(loop, 500, Setpoint(1.0, 0.0, 0.0))
    loop.measure(600, 0.0)
    assert loop.commands == [0.1]


def test_the_integral_does_not_grow_at_the_limit() -> None:
    loop = tracking(kp=5.0, ki=1.0, limit=1.0)
    put(loop, 10, Setpoint(1.0, 0.0, 0.0))
    for at_ms in range(10, 200, 10):
        loop.measure(at_ms, 0.0)
    assert loop.pid.integral_n == 0.0
    assert loop.commands[-1] == 1.0
