import math

import pytest
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.servo import Servo, Servos, ServosSettings

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.budget import bits
from firmware_runtime.hal.wire_errors import Fault
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.worlds.servo import ServoParameters, ServoPlant, pulse_of
from tests.support.servos import PAN

TILT = Servo(
    name="tilt",
    channel=5,
    least_rad=0.0,
    most_rad=0.5,
    least_pulse_us=2000.0,
    most_pulse_us=1500.0,
    slew_rad_s=100.0,
)


def settings(timeout: int = NEVER) -> ServosSettings:
    return ServosSettings(
        servos=(PAN, TILT), frequency_hz=50.0, period=20 * MILLISECOND, timeout=timeout
    )


class Bench:
    """Two servos on a PCA9685 double; commands come in by hand."""

    def __init__(self, timeout: int = NEVER) -> None:
        self.simulator: Simulator | None = None
        self.enabled = True
        self.chip = Pca9685Double(self.now)
        self.plant = ServoPlant(
            ServoParameters(least_pulse_us=1000.0, most_pulse_us=2000.0), pulse_of(self.chip, 2)
        )
        self.chip.before_change = lambda: self.plant.advance(self.now())
        self.bus = I2cBusDouble("i2c1", self.now, [self.chip])
        top = Coupled("top")
        self.model = top.add(
            Servos("head", Pca9685(self.bus), settings(timeout), lambda: self.enabled)
        )
        self.ports = {
            "pan": top.in_port("pan", float),
            "tilt": top.in_port("tilt", float),
        }
        self.release_port = top.in_port("release", bool)
        for name, port in self.ports.items():
            top.couple(port, self.model.angle[name])
        top.couple(self.release_port, self.model.release)
        self.simulator = Simulator(top, checked=True)
        self.faults: list[Fault] = []
        self.simulator.listen(self.model.fault_out, lambda _at, value: self.faults.append(value))

    def now(self) -> int:
        return 0 if self.simulator is None else self.simulator.now

    def run(self, until_ms: int) -> None:
        assert self.simulator is not None
        self.simulator.run(until_ms * MILLISECOND)

    def turn(self, at_ms: int, **angles: float) -> None:
        assert self.simulator is not None
        self.run(at_ms)
        for name, angle in angles.items():
            self.simulator.inject(self.ports[name], angle)
        self.simulator.advance(at_ms * MILLISECOND)

    def release(self, at_ms: int) -> None:
        assert self.simulator is not None
        self.run(at_ms)
        self.simulator.inject(self.release_port, True)
        self.simulator.advance(at_ms * MILLISECOND)

    def pulse_us(self, servo: Servo) -> float:
        return pulse_of(self.chip, servo.channel)()


def close(pulse_us: float) -> object:
    return pytest.approx(pulse_us, abs=4.0)  # a count is 4.9 us


def test_all_servos_are_limp_until_a_command_comes_and_then_only_that_one_is_driven() -> None:
    bench = Bench()
    bench.run(1000)
    assert bench.chip.all_off
    bench.turn(1000, pan=0.5)
    assert bench.pulse_us(PAN) == close(1750.0)
    assert bench.pulse_us(TILT) == 0.0


def test_a_chip_that_a_probe_has_just_woken_is_brought_up_once_its_oscillator_runs() -> None:
    bench = Bench()
    bench.model.chip.silence()
    bench.model.chip.identify()
    bench.turn(100, pan=0.5)
    assert bench.chip.warnings == []
    assert bench.pulse_us(PAN) == close(1750.0)


def test_a_servo_upside_down_has_its_longer_pulse_at_the_lesser_angle() -> None:
    bench = Bench()
    bench.turn(100, tilt=0.1)
    assert bench.pulse_us(TILT) == close(1900.0)


@pytest.mark.parametrize(("angle", "pulse_us"), [(9.0, 2000.0), (-9.0, 1000.0)])
def test_a_command_beyond_the_limits_is_cut_to_them(angle: float, pulse_us: float) -> None:
    bench = Bench()
    bench.turn(100, pan=angle)
    assert bench.pulse_us(PAN) == close(pulse_us)


def test_the_angle_changes_no_faster_than_the_slew_however_often_commands_come() -> None:
    bench = Bench()
    bench.turn(100, pan=-1.0)
    for at_ms in range(200, 700, 31):
        bench.turn(at_ms, pan=1.0)
        expected = -1.0 + 2.0 * (at_ms - 200) / 1000
        assert bench.model.written["pan"] == pytest.approx(expected, abs=0.05)
    bench.run(1300)
    assert bench.model.written["pan"] == 1.0
    assert bench.pulse_us(PAN) == close(2000.0)


def test_the_plant_follows_and_holds() -> None:
    bench = Bench()
    bench.turn(100, pan=1.0)
    bench.run(400)
    assert bench.plant.angle_rad(bench.now()) == pytest.approx(math.pi / 2, abs=0.02)
    bench.release(400)
    bench.run(600)
    assert bench.chip.all_off
    assert bench.plant.angle_rad(bench.now()) == pytest.approx(math.pi / 2, abs=0.02)
    assert bench.faults == []


def test_without_a_new_command_for_the_timeout_all_go_limp() -> None:
    bench = Bench(timeout=500 * MILLISECOND)
    bench.turn(100, pan=0.2)
    bench.run(590)
    assert not bench.chip.all_off
    bench.run(640)
    assert bench.chip.all_off
    assert len(bench.faults) == 1
    bench.turn(700, pan=0.2)
    assert bench.pulse_us(PAN) == close(1600.0)


def test_what_is_no_angle_makes_all_limp() -> None:
    bench = Bench()
    bench.turn(100, pan=0.2)
    bench.turn(200, tilt=math.nan)
    assert bench.chip.all_off
    assert "nan rad" in bench.faults[0].reason


def test_the_interlock_turns_all_off_and_the_command_waits_for_it() -> None:
    bench = Bench()
    bench.turn(100, pan=0.2)
    bench.enabled = False
    bench.run(130)
    assert bench.chip.all_off
    bench.turn(500, pan=-0.2)
    bench.run(1000)
    assert bench.chip.all_off
    bench.enabled = True
    bench.run(2000)
    assert bench.pulse_us(PAN) == close(1400.0)


def test_a_chip_that_lost_power_is_brought_up_again_and_gets_its_command() -> None:
    bench = Bench()
    bench.turn(100, pan=0.2)
    bench.bus.power_cycle()
    bench.run(1000)
    assert bench.pulse_us(PAN) == close(1600.0)
    assert len(bench.faults) == 1


def test_a_refusal_on_the_bus_is_followed_by_off_and_then_by_the_same_command() -> None:
    bench = Bench()
    bench.turn(100, pan=0.2)
    bench.bus.faults = FaultScript([NackAddress(address=0x40, times=1)])
    bench.run(1000)
    assert bench.pulse_us(PAN) == close(1600.0)
    assert len(bench.faults) == 1


def test_the_end_leaves_everything_off() -> None:
    bench = Bench()
    bench.turn(100, pan=0.2, tilt=0.3)
    bench.model.exit()
    assert bench.chip.all_off


def test_the_traffic_stated_is_that_of_a_period_and_of_a_command() -> None:
    bench = Bench()
    bench.turn(100, pan=0.2, tilt=0.3)
    before = bench.bus.bits
    bench.run(120)
    once = sum(map(bits, settings().traffic))
    assert bench.bus.bits - before == once
    bench.turn(130, pan=0.1, tilt=0.3)
    assert bench.bus.bits - before == 2 * once
    bench.turn(150, pan=0.2, tilt=0.3)  # at the instant at which the pulses are due again
    assert bench.bus.bits - before == 4 * once


def test_every_wrong_setting_is_named() -> None:
    wrong = Servo(
        name="pan",
        channel=16,
        least_rad=1.0,
        most_rad=1.0,
        least_pulse_us=0.0,
        most_pulse_us=30_000.0,
        slew_rad_s=0.0,
    )
    found = ServosSettings(servos=(PAN, wrong), frequency_hz=50.0, period=0, timeout=-1).faults()
    keys = [fault.partition(":")[0] for fault in found]
    assert keys == [
        *("pan.channel", "pan.least_rad, most_rad", "pan.slew_rad_s"),
        *("pan.least_pulse_us", "pan.most_pulse_us", "name", "period", "timeout"),
    ]
    too_fast = ServosSettings(servos=(PAN,), frequency_hz=1000.0, period=1)
    assert [fault.partition(":")[0] for fault in too_fast.faults()] == ["frequency_hz"]
    empty = ServosSettings(servos=(), frequency_hz=50.0, period=1)
    with pytest.raises(SettingError, match="servos: none"):
        Servos("head", Pca9685(I2cBusDouble("i2c1", lambda: 0, [])), empty)
