import pytest

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.models.motion import Motion, Setpoint
from firmware_runtime.models.pid import PidGains, TrackingPid


class Loop:
    """A tracking PID alone, fed from outside; `commands` holds what it sent."""

    def __init__(self, inertia: float = 0.0, **changes: float) -> None:
        gains = PidGains(**{"kp": 0.0, "ki": 0.0, "kd": 0.0, "limit": 10.0, **changes})  # type: ignore[arg-type]
        top = Coupled("top")
        self.pid = top.add(TrackingPid("pid", gains, inertia, 200 * MILLISECOND))
        self.measurement = top.in_port("measurement", Motion)
        self.setpoint = top.in_port("setpoint", Setpoint)
        top.couple(self.measurement, self.pid.measurement)
        top.couple(self.setpoint, self.pid.setpoint)
        self.simulator = Simulator(top, checked=True)
        self.commands: list[float] = []
        self.simulator.listen(self.pid.command, lambda _at, value: self.commands.append(value))

    def put(self, at_ms: int, setpoint: Setpoint) -> None:
        self.simulator.inject(self.setpoint, setpoint)
        self.simulator.advance(at_ms * MILLISECOND)

    def measure(self, at_ms: int, position: float, rate: float = 0.0) -> None:
        self.simulator.inject(self.measurement, Motion(position, rate))
        self.simulator.advance(at_ms * MILLISECOND)


def test_without_a_setpoint_a_measurement_has_no_answer() -> None:
    loop = Loop(kp=1.0)
    loop.measure(10, 1.0)
    assert loop.commands == []


def test_the_setpoints_acceleration_is_fed_forward() -> None:
    loop = Loop(inertia=3.0)
    loop.put(10, Setpoint(0.0, 0.0, 0.2))
    loop.measure(10, 5.0)
    assert loop.commands == [pytest.approx(0.6)]


def test_the_derivative_acts_on_the_difference_of_the_rates() -> None:
    loop = Loop(kd=2.0)
    loop.put(10, Setpoint(0.0, 0.5, 0.0))
    loop.measure(10, 0.0, rate=0.2)
    assert loop.commands == [pytest.approx(0.6)]


def test_a_setpoint_goes_on_with_its_rate_and_acceleration_until_the_next() -> None:
    loop = Loop(kp=1.0)
    loop.put(10, Setpoint(1.0, 0.5, 0.2))
    loop.measure(110, 0.0)
    assert loop.commands == [pytest.approx(1.0 + 0.05 + 0.001)]


def test_a_setpoint_that_is_too_old_is_none() -> None:
    loop = Loop(kp=1.0)
    loop.put(10, Setpoint(1.0, 0.0, 0.0))
    loop.measure(210, 0.0)
    loop.measure(211, 0.0)
    assert len(loop.commands) == 1


def test_the_integral_does_not_grow_at_the_limit() -> None:
    loop = Loop(kp=5.0, ki=1.0, limit=1.0)
    loop.put(10, Setpoint(1.0, 0.0, 0.0))
    for at_ms in range(10, 200, 10):
        loop.measure(at_ms, 0.0)
    assert loop.pid.integral_n == 0.0
    assert loop.commands[-1] == 1.0
