"""The actuator alone, on the double of its chip: what switches it off, and what it says then."""

import math

import pytest
from underwater.winch.double import WinchDouble
from underwater.winch.haul import Haul
from underwater.winch.motor import WinchMotor

from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND
from sim_doubles.i2c_bus import I2cBusDouble

TIMEOUT = 100 * MILLISECOND


class Bench:
    """One haul in virtual time; `is_enabled` is its interlock."""

    def __init__(self) -> None:
        self.at = 0
        self.is_enabled = True
        self.chip = WinchDouble(lambda: self.at, world={"place_m": 0.0})
        bus = I2cBusDouble("i2c1", lambda: self.at, [self.chip])
        self.haul = Haul("haul", WinchMotor(bus), TIMEOUT, lambda: self.is_enabled)
        self.simulator = Simulator(self.haul, checked=True)
        self.faults: list[str] = []
        self.applied: list[str] = []
        self.simulator.listen(
            self.haul.applied_out, lambda _, applied: self.applied.append(applied.name)
        )
        self.simulator.listen(
            self.haul.fault_out, lambda _, fault: self.faults.append(fault.reason)
        )
        self.run_for(10)

    def run_for(self, milliseconds: int) -> None:
        for _ in range(milliseconds):
            self.at += MILLISECOND
            self.simulator.run(self.at)

    def command(self, power: float) -> None:
        self.simulator.inject(self.haul.power_in, power)
        self.simulator.advance(self.at)
        self.run_for(1)


def test_brought_up_it_is_off_and_waits() -> None:
    bench = Bench()
    assert (bench.haul.phase, bench.chip.is_on, bench.haul.unready()) == ("off", False, None)


def test_power_reaches_the_motor_and_0_is_off_with_the_brake_on() -> None:
    bench = Bench()
    bench.command(-0.5)
    assert bench.chip.power == pytest.approx(-0.5, abs=0.01)
    bench.command(0.0)
    assert (bench.chip.is_on, bench.faults) == (False, [])


@pytest.mark.parametrize("power", [math.nan, math.inf, 1.01])
def test_what_is_no_power_stops_it(power: float) -> None:
    bench = Bench()
    bench.command(0.5)
    bench.command(power)
    assert not bench.chip.is_on
    assert "expected -1 to 1" in bench.faults[0]


def test_a_command_holds_for_its_timeout_and_no_longer() -> None:
    bench = Bench()
    bench.command(0.5)
    bench.run_for(90)
    assert bench.chip.is_on
    bench.run_for(20)
    assert (bench.chip.is_on, bench.haul.phase, len(bench.faults)) == (False, "off", 1)


def test_the_interlock_stops_it_and_what_comes_meanwhile_is_not_kept() -> None:
    bench = Bench()
    bench.command(0.5)
    bench.is_enabled = False
    bench.run_for(20)
    assert (bench.chip.is_on, bench.haul.phase, bench.faults) == (False, "disabled", [])
    assert bench.applied == ["NOTHING", "ALL", "NOTHING"]
    bench.command(0.5)
    bench.is_enabled = True
    bench.run_for(50)
    assert (bench.chip.is_on, bench.haul.phase) == (False, "off")
    bench.command(0.5)
    assert bench.chip.is_on


def test_what_is_no_power_is_reported_while_outputs_are_disabled_too() -> None:
    bench = Bench()
    bench.is_enabled = False
    bench.command(0.5)
    assert (bench.haul.phase, bench.faults) == ("disabled", [])
    for _ in range(3):
        bench.command(math.nan)
    assert (bench.haul.phase, len(bench.faults)) == ("disabled", 3)
    assert "nan" in bench.faults[0]


def test_commands_do_not_put_off_the_check_of_a_chip_that_was_reset() -> None:
    bench = Bench()
    bench.command(0.5)
    bench.chip.power_cycle()
    for _ in range(60):
        bench.command(0.5)
        bench.run_for(19)
    assert "LIMIT" in bench.faults[0]
    assert (bench.chip.word("LIMIT"), bench.chip.is_on) == (0x60, True)
