import math

import pytest

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.models.motion import Motion
from firmware_runtime.models.pid import Pid, PidGains


class Loop:
    """A PID alone, fed from outside; `commands` holds what it sent."""

    def __init__(self, gains: PidGains, reference: float = 1.0) -> None:
        top = Coupled("top")
        self.pid = top.add(Pid("pid", gains, reference))
        self.measurement = top.in_port("measurement", Motion)
        self.reference = top.in_port("reference", float)
        top.couple(self.measurement, self.pid.measurement)
        top.couple(self.reference, self.pid.reference_in)
        self.simulator = Simulator(top, checked=True)
        self.commands: list[float] = []
        self.simulator.listen(self.pid.command, lambda _at, value: self.commands.append(value))

    def measure(self, at_ms: int, position: float, rate: float = 0.0) -> float:
        self.simulator.inject(self.measurement, Motion(position, rate))
        self.simulator.advance(at_ms * MILLISECOND)
        return self.commands[-1]

    def refer(self, at_ms: int, reference: float) -> None:
        self.simulator.inject(self.reference, reference)
        self.simulator.advance(at_ms * MILLISECOND)


def gains(**changes: float) -> PidGains:
    return PidGains(**{"kp": 0.0, "ki": 0.0, "kd": 0.0, "limit": 10.0, **changes})  # type: ignore[arg-type]


def test_the_proportional_part_is_gain_times_error() -> None:
    assert Loop(gains(kp=2.0)).measure(0, 0.25) == pytest.approx(1.5)


def test_the_derivative_acts_on_the_measured_rate_and_not_on_the_reference() -> None:
    loop = Loop(gains(kd=3.0))
    assert loop.measure(0, 0.0, rate=0.5) == pytest.approx(-1.5)
    loop.refer(5, 100.0)
    assert loop.measure(10, 0.0, rate=0.5) == pytest.approx(-1.5)


def test_the_integral_uses_the_time_that_passed_between_measurements() -> None:
    loop = Loop(gains(ki=1.0))
    assert loop.measure(500, 0.0) == 0.0
    assert loop.measure(600, 0.0) == pytest.approx(0.1)
    assert loop.measure(1600, 0.5) == pytest.approx(0.6)


def test_a_reference_in_between_does_not_cut_the_integration_time_short() -> None:
    loop = Loop(gains(ki=1.0))
    loop.measure(0, 0.0)
    loop.refer(40, 1.0)
    assert loop.measure(100, 0.0) == pytest.approx(0.1)


def test_the_command_stays_within_its_limit() -> None:
    loop = Loop(gains(kp=100.0, limit=0.8))
    assert loop.measure(0, 0.0) == 0.8
    assert loop.measure(10, 2.0) == -0.8


@pytest.mark.parametrize(("anti_windup", "integral"), [(True, 0.0), (False, 2.0)])
def test_anti_windup_freezes_the_integral_at_the_limit(
    anti_windup: bool,  # noqa: FBT001 -- a parameter of the test
    integral: float,
) -> None:
    loop = Loop(PidGains(kp=5.0, ki=1.0, kd=0.0, limit=1.0, anti_windup=anti_windup))
    loop.measure(0, 0.0)
    loop.measure(2000, 0.0)
    assert loop.pid.integral_n == pytest.approx(integral)


def test_anti_windup_lets_the_integral_leave_the_limit() -> None:
    loop = Loop(PidGains(kp=5.0, ki=1.0, kd=0.0, limit=1.0))
    loop.pid.integral_n = 3.0
    loop.measure(0, 0.0)
    loop.measure(1000, 1.5)
    assert loop.pid.integral_n == pytest.approx(2.5)


@pytest.mark.parametrize("reference", [math.nan, math.inf])
def test_a_reference_that_is_not_finite_is_ignored(reference: float) -> None:
    loop = Loop(gains(kp=1.0))
    loop.refer(0, reference)
    assert loop.measure(10, 0.0) == 1.0
