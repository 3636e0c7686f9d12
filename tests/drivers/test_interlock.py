"""With outputs disabled nothing that could move is written; enabled, commands are obeyed."""

import pytest
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.esc import Esc, EscSettings
from firmware_drivers.thrust_pairs import Forces, ThrustPairs, ThrustSettings

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, SECOND
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.scripted_treads import STOP, ScriptedDriver, bench_of, settings


class Switch:
    """An interlock that a test enables and disables."""

    def __init__(self) -> None:
        self.enabled = False

    def __call__(self) -> bool:
        return self.enabled


@pytest.fixture
def interlock() -> Switch:
    return Switch()


class ThrustBench:
    """Thrust pairs on a double, with forces every 10 ms."""

    def __init__(self, interlock: Switch) -> None:
        self.chip = Pca9685Double(lambda: self.simulator.now)
        thrust = ThrustSettings(0.4, 1000.0, 1e6, 50 * MILLISECOND, 0)
        self.simulator: Simulator
        self.bus = bus = I2cBusDouble("i2c1", self._now, [self.chip])
        top = Coupled("top")
        self.model = top.add(ThrustPairs("thrust", Pca9685(bus), thrust, interlock))
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


def test_forces_have_no_effect_while_outputs_are_disabled(interlock: Switch) -> None:
    bench = ThrustBench(interlock)
    bench.push(5)
    assert bench.on == 0
    interlock.enabled = True
    bench.push(5)
    assert bench.on == 8


def test_propellers_are_switched_off_when_outputs_are_disabled(interlock: Switch) -> None:
    bench = ThrustBench(interlock)
    interlock.enabled = True
    bench.push(5)
    interlock.enabled = False
    bench.push(1)
    assert bench.on == 0
    assert bench.chip.all_off
    assert bench.model.faults == []


def test_treads_keep_a_command_until_outputs_are_enabled(interlock: Switch) -> None:
    driver = ScriptedDriver()
    bench = bench_of(driver, settings())
    bench.model.interlock = interlock  # type: ignore[attr-defined]
    bench.put(50, right=1, left=1)
    bench.run(500)
    assert [call for call, _ in driver.driven] == [STOP]
    interlock.enabled = True
    bench.run(530)
    assert driver.driven[-1][0] == (0.5, 0.5)


def test_moving_treads_are_stopped_and_go_on_once_outputs_are_enabled(interlock: Switch) -> None:
    driver = ScriptedDriver()
    bench = bench_of(driver, settings())
    bench.model.interlock = interlock  # type: ignore[attr-defined]
    interlock.enabled = True
    bench.put(50, right=1, left=1)
    bench.run(60)
    interlock.enabled = False
    bench.run(300)
    interlock.enabled = True
    bench.run(400)
    assert [call for call, _ in driver.driven] == [(0.5, 0.5), STOP, (0.5, 0.5)]


def test_an_esc_is_armed_again_once_outputs_are_enabled_again(interlock: Switch) -> None:
    esc = EscSettings(
        channel=3, frequency_hz=50.0, low_pulse_us=1000.0, high_pulse_us=2000.0, arming=3 * SECOND
    )
    top = Coupled("top")
    chip = Pca9685Double(lambda: 0)
    model = top.add(Esc("esc", Pca9685(I2cBusDouble("i2c1", lambda: 0, [chip])), esc, interlock))
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
    interlock.enabled = True
    simulator.run(9 * SECOND)
    assert armed == [True]
    interlock.enabled = False
    simulator.run(10 * SECOND)
    assert (armed, model.phase) == ([True, False], "disabled")
    interlock.enabled = True
    simulator.run(14 * SECOND)
    assert armed == [True, False, True]


def test_thrust_pairs_that_failed_may_be_enabled_again_once_the_chip_answers(
    interlock: Switch,
) -> None:
    bench = ThrustBench(interlock)
    interlock.enabled = True
    bench.push(2)
    bench.bus.faults = FaultScript([NackAddress(times=3)])
    bench.push(1)
    interlock.enabled = False
    assert bench.model.unready() == "has failed 2 times in a row"
    bench.push(5)
    assert (bench.on, bench.model.unready()) == (0, None)
