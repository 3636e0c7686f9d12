"""Without leave nothing that could move is written; with it, orders are obeyed as ever."""

import pytest

from drivers.chips.pca9685 import Pca9685
from drivers.esc import Esc, EscSettings
from drivers.thrust_pairs import Forces, ThrustPairs, ThrustSettings
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, SECOND
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.scripted_treads import STOP, ScriptedDriver, bench_of, settings


class Leave:
    """Leave that a test gives and withdraws."""

    def __init__(self) -> None:
        self.given = False

    def __call__(self) -> bool:
        return self.given


@pytest.fixture
def leave() -> Leave:
    return Leave()


class ThrustBench:
    """Thrust pairs on a double, with forces every 10 ms."""

    def __init__(self, leave: Leave) -> None:
        self.chip = Pca9685Double(lambda: self.simulator.now)
        thrust = ThrustSettings(0.4, 1000.0, 1e6, 50 * MILLISECOND, 0)
        self.simulator: Simulator
        bus = I2cBusDouble("i2c1", self._now, [self.chip])
        top = Coupled("top")
        self.model = top.add(ThrustPairs("thrust", Pca9685(bus), thrust, leave))
        self.forces = top.in_port("forces", Forces)
        top.couple(self.forces, self.model.forces)
        self.simulator = Simulator(top, checked=True)
        self._at = 100

    def _now(self) -> int:
        return self.simulator.now if hasattr(self, "simulator") else 0

    def push(self, times: int) -> None:
        for _ in range(times):
            self._at += 10
            self.simulator.run(self._at * MILLISECOND)
            self.simulator.inject(self.forces, Forces(0.2, 0.2, 0.2, 0.2))
            self.simulator.advance(self._at * MILLISECOND)

    @property
    def on(self) -> int:
        return sum(duty > 0 for duty in self.model.duties)


def test_forces_without_leave_have_no_effect(leave: Leave) -> None:
    bench = ThrustBench(leave)
    bench.push(5)
    assert bench.on == 0
    leave.given = True
    bench.push(5)
    assert bench.on == 8


def test_propellers_are_switched_off_when_leave_is_withdrawn(leave: Leave) -> None:
    bench = ThrustBench(leave)
    leave.given = True
    bench.push(5)
    leave.given = False
    bench.push(1)
    assert bench.on == 0
    assert bench.chip.all_off
    assert bench.model.faults == []


def test_treads_keep_an_order_until_there_is_leave(leave: Leave) -> None:
    driver = ScriptedDriver()
    bench = bench_of(driver, settings())
    bench.model.interlock = leave  # type: ignore[attr-defined]
    bench.put(50, right=1, left=1)
    bench.run(500)
    assert [call for call, _ in driver.driven] == [STOP]
    leave.given = True
    bench.run(530)
    assert driver.driven[-1][0] == (0.5, 0.5)


def test_moving_treads_are_stopped_and_go_on_with_leave(leave: Leave) -> None:
    driver = ScriptedDriver()
    bench = bench_of(driver, settings())
    bench.model.interlock = leave  # type: ignore[attr-defined]
    leave.given = True
    bench.put(50, right=1, left=1)
    bench.run(60)
    leave.given = False
    bench.run(300)
    leave.given = True
    bench.run(400)
    assert [call for call, _ in driver.driven] == [(0.5, 0.5), STOP, (0.5, 0.5)]


def test_an_esc_is_armed_anew_after_leave_was_withdrawn(leave: Leave) -> None:
    esc = EscSettings(
        channel=3, frequency_hz=50.0, low_pulse_us=1000.0, high_pulse_us=2000.0, arming=3 * SECOND
    )
    top = Coupled("top")
    chip = Pca9685Double(lambda: 0)
    model = top.add(Esc("esc", Pca9685(I2cBusDouble("i2c1", lambda: 0, [chip])), esc, leave))
    arm = top.in_port("arm", bool)
    top.couple(arm, model.arm)
    simulator = Simulator(top)
    armed: list[bool] = []
    simulator.listen(model.armed_out, lambda _at, value: armed.append(value))
    simulator.run(SECOND)
    simulator.inject(arm, True)
    simulator.advance(SECOND)
    simulator.run(5 * SECOND)
    assert (armed, model.phase) == ([], "disabled")
    leave.given = True
    simulator.run(9 * SECOND)
    assert armed == [True]
    leave.given = False
    simulator.run(10 * SECOND)
    assert (armed, model.phase) == ([True, False], "disabled")
    leave.given = True
    simulator.run(14 * SECOND)
    assert armed == [True, False, True]
