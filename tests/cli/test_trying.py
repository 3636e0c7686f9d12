"""Trying chips out on their doubles, in virtual time: every sensor reads, every actuator stops."""

import io
import math
import re
from collections.abc import Mapping, Sequence
from typing import Any

import pytest
from firmware_drivers.catalogue.table import chips
from firmware_drivers.catalogue.trial import Actuator, OnBus, Reading, Sensor
from firmware_drivers.chips.md25 import Md25
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.step import Step
from firmware_drivers.commands.readings import Readings
from firmware_drivers.commands.trying import ATTEMPTS, Watch, drive, switch_off, take

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import NoAcknowledge, NotReady
from sim_doubles.chip_doubles import chip_double, names
from sim_doubles.clock import ManualClock
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.serial_line import SerialLineDouble


class TrialPace:
    """The doubles' clock, and a stop that comes at an instant."""

    def __init__(self, stop_at: int = NEVER) -> None:
        self.clock = ManualClock(1_000_000_000)
        self._stop_at = stop_at

    def now(self) -> int:
        return self.clock()

    def wait(self, span: int) -> bool:
        stops = self.clock() + span >= self._stop_at
        self.clock.advance(min(span, max(self._stop_at - self.clock(), 0)))
        return stops


MOVES: Mapping[str, dict[str, Any]] = {
    "pca9685": {"channel": 3, "duty": 0.25},
    "h_bridge": {"pwm": 8, "in1": 9, "in2": 10, "speed": -0.5},
    "md25": {"left": 0.5, "right": -0.5},
    "sabertooth": {"left": 0.5, "right": -0.5},
}
KEYS: Mapping[str, set[str]] = {
    "mpu9250": {"acceleration_m_s2", "rate_rad_s", "field_t", "temperature_c"},
    "ak8963": {"field_t"},
    "srf08": {"distance_m"},
    "maxbotix": {"distance_m"},
    "cmps12": {"bearing_rad", "calibration"},
    "hmc5883l": {"field_t"},
    "ads1115": {"voltage_v"},
}


class Rig:
    """One chip, its double and its line, on one clock."""

    def __init__(self, name: str, pace: TrialPace, **said: Any) -> None:  # noqa: ANN401
        chip = chips()[name]
        options = {option.name.replace("-", "_"): option.default for option in chip.options}
        options |= {"imu_address": 0x68} | said
        self.pace = pace
        self.name = name
        self._ramp = SECOND if name == "md25" else 200 * MILLISECOND
        if isinstance(chip, OnBus):
            self.doubles: Sequence[Any] = chip_double(name).on_bus(pace.clock, chip.address)
            self.bus = I2cBusDouble("double", pace.clock, self.doubles, reach=pace.clock.reach)
            self.chip = chip.build(self.bus, chip.address, options)
        else:
            target = chip_double(name).on_port(pace.clock)
            self.doubles = [target]
            self.chip = chip.build(SerialLineDouble("double", pace.clock, target), options)
        self.shown: list[tuple[int, Reading]] = []
        self.reported: list[str] = []

    @property
    def sensor(self) -> Sensor:
        assert isinstance(self.chip, Sensor)
        return self.chip

    @property
    def actuator(self) -> Actuator:
        assert isinstance(self.chip, Actuator)
        return self.chip

    def watch(self, span: int) -> Watch:
        watch = Watch(self.sensor, self.pace, self.show, self.reported.append)
        watch.run(SECOND // 5, span)
        return watch

    def drive(self, span: int) -> bool:
        assert not take(self.actuator.bring_up(), self.pace)
        return drive(self.actuator, self.pace, span, self.show)

    def stop_from_elsewhere(self) -> None:
        chip = chips()[self.name]
        assert isinstance(chip, OnBus)
        if self.name == "md25":
            Md25(self.bus, chip.address).stop()
        else:
            Pca9685(self.bus, chip.address).stop_all()

    def show(self, at: int, reading: Reading) -> None:
        self.shown.append((at, reading))

    @property
    def is_moving(self) -> bool:
        """Whether an output is on, or a motor turns once ramps are over, and before timeouts."""
        (double, *_) = self.doubles
        if hasattr(double, "duties"):
            return any(double.duties)
        return any(double.motors.speeds_rad_s(self.pace.now() + self._ramp))


OF_AN_EXAMPLE = {"brook", "plumb", "winch"}  # examples/underwater, where it is installed


def test_every_chip_of_the_table_has_a_double() -> None:
    ours = {name: chip for name, chip in chips().items() if name not in OF_AN_EXAMPLE}
    assert set(names()) - OF_AN_EXAMPLE == set(ours) == {*KEYS, *MOVES}
    assert {chip.name for chip in ours.values() if chip.moves} == set(MOVES)
    on_bus = [chip for chip in ours.values() if isinstance(chip, OnBus)]
    assert all(chip.address in chip.addresses for chip in on_bus)
    assert {chip.name: chip.address for chip in on_bus}["ads1115"] == 0x48  # ADDR at ground


@pytest.mark.parametrize("name", sorted(KEYS))
def test_a_sensor_is_read_in_si_units_until_its_time_is_up(name: str) -> None:
    rig = Rig(name, TrialPace())
    watch = rig.watch(2 * SECOND)
    assert 8 <= watch.values == len(rig.shown) <= 11
    for _, reading in rig.shown:
        assert {quantity.key for quantity in reading} == KEYS[name]
    assert rig.shown[0][1] != rig.shown[-1][1]
    assert all(double.warnings == [] for double in rig.doubles)


@pytest.mark.parametrize(
    ("name", "unit", "in_si"),
    [("cmps12", "deg", math.radians(1)), ("hmc5883l", "uT", 1e-6), ("ads1115", "V", 1.0)],
)
def test_people_see_the_value_in_their_unit(name: str, unit: str, in_si: float) -> None:
    rig = Rig(name, TrialPace())
    rig.watch(2 * SECOND)
    stream = io.StringIO()
    Readings(stream, as_json=False, never_waits=False).show(*rig.shown[-1])
    seen = re.search(rf"(\S+) {unit}\b", stream.getvalue())
    assert seen is not None
    read = rig.shown[-1][1][0].value
    assert read is not None
    last = read[-1] if isinstance(read, tuple) else read
    assert float(seen[1]) * in_si == pytest.approx(last, abs=0.06 * in_si)


@pytest.mark.parametrize("name", sorted(MOVES))
def test_an_actuator_moves_for_its_time_and_is_off_afterwards(name: str) -> None:
    rig = Rig(name, TrialPace(), **MOVES[name])
    assert rig.drive(5 * SECOND) is False
    assert rig.is_moving
    assert rig.shown[-1][0] == 5 * SECOND
    assert switch_off(rig.actuator) == []
    assert not rig.is_moving
    assert all(double.warnings == [] for double in rig.doubles)


@pytest.mark.parametrize("name", ["md25", "sabertooth"])
def test_one_motor_may_be_moved_alone(name: str) -> None:
    rig = Rig(name, TrialPace(), left=0.5)
    assert rig.drive(5 * SECOND) is False
    assert rig.is_moving


@pytest.mark.parametrize("name", sorted(MOVES))
def test_a_stop_that_came_before_lets_nothing_move(name: str) -> None:
    rig = Rig(name, TrialPace(stop_at=0), **MOVES[name])
    assert drive(rig.actuator, rig.pace, SECOND, rig.show) is True
    assert not rig.is_moving


@pytest.mark.parametrize("name", sorted(MOVES))
def test_a_stop_ends_moving_at_once(name: str) -> None:
    rig = Rig(name, TrialPace(stop_at=2 * SECOND), **MOVES[name])
    assert rig.drive(50 * SECOND) is True
    assert rig.pace.now() == 2 * SECOND
    assert switch_off(rig.actuator) == []
    assert not rig.is_moving


@pytest.mark.parametrize(
    ("pulse_us", "duty"), [(1500.0, 1500e-6 * 50.03), (2000.0, 2000e-6 * 50.03)]
)
def test_a_pulse_is_as_long_as_asked_for(pulse_us: float, duty: float) -> None:
    rig = Rig("pca9685", TrialPace(), channel=0, pulse_us=pulse_us)
    rig.drive(SECOND)
    assert rig.doubles[0].duty(0) == pytest.approx(duty, abs=1 / 4096)


def test_a_pwm_chip_that_loses_its_supply_ends_the_trial() -> None:
    rig = Rig("pca9685", TrialPace(), channel=0, duty=0.5)
    take(rig.actuator.bring_up(), rig.pace)
    rig.actuator.move()
    rig.bus.power_cycle()
    with pytest.raises(NotReady):
        drive(rig.actuator, rig.pace, SECOND, rig.show)


@pytest.mark.parametrize("name", ["pca9685", "h_bridge"])
def test_an_output_that_stands_is_not_written_again(name: str) -> None:
    rig = Rig(name, TrialPace(), **MOVES[name])
    take(rig.actuator.bring_up(), rig.pace)
    rig.actuator.move()
    rig.bus.log.clear()
    rig.actuator.move()
    assert rig.bus.log
    assert all(each.to_read for each in rig.bus.log)


@pytest.mark.parametrize("name", ["pca9685", "h_bridge", "md25"])
def test_what_another_program_switched_off_stays_off(name: str) -> None:
    """As by `safe-state` from another terminal."""
    rig = Rig(name, TrialPace(), **MOVES[name])
    take(rig.actuator.bring_up(), rig.pace)
    rig.actuator.move()
    rig.actuator.move()
    rig.stop_from_elsewhere()
    with pytest.raises(NotReady):
        rig.actuator.move()
    assert not rig.is_moving


def test_what_cannot_be_switched_off_at_first_is_switched_off_again() -> None:
    rig = Rig("pca9685", TrialPace(), channel=0, duty=0.5)
    rig.drive(SECOND)
    rig.bus.faults = FaultScript([NackAddress(address=0x40, times=3)])
    assert switch_off(rig.actuator) == []
    assert not rig.is_moving


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("pca9685", {"channel": 0}),
        ("pca9685", {"channel": 0, "duty": 0.1, "pulse_us": 1500.0}),
        ("pca9685", {"channel": 0, "pulse_us": 1500.0, "frequency_hz": 1000.0}),
        ("pca9685", {"channel": 0, "duty": 0.1, "frequency_hz": 5000.0}),
        ("h_bridge", {"pwm": 8, "in1": 8, "in2": 9, "speed": 0.1}),
        ("md25", {}),
        ("sabertooth", {"left": 0.1, "switches": 200}),
        ("maxbotix", {"family": "none"}),
    ],
)
def test_options_that_do_not_fit_are_refused(name: str, said: dict[str, Any]) -> None:
    with pytest.raises(SettingError):
        Rig(name, TrialPace(), **said)


def test_an_absent_sensor_is_an_error_and_not_waited_for() -> None:
    rig = Rig("cmps12", TrialPace())
    rig.bus.faults = FaultScript([NackAddress(address=0x60, times=None)])
    with pytest.raises(NoAcknowledge):
        rig.watch(10 * SECOND)


def test_a_sensor_that_is_never_ready_is_brought_up_a_few_times_and_is_then_an_error() -> None:
    def bring_up() -> Sequence[Step]:
        raise NotReady("it warms up")

    reported: list[str] = []
    unready = Sensor(place="scales", bring_up=bring_up, read=list)
    with pytest.raises(NotReady):
        Watch(unready, TrialPace(), lambda *_: None, reported.append).run(SECOND, None)
    assert reported == ["it warms up"] * (ATTEMPTS - 1)


def test_a_sensor_that_fails_meanwhile_is_reported_and_brought_up_again() -> None:
    rig = Rig("mpu9250", TrialPace())
    away = NackAddress(address=0x68, since=3 * SECOND, until=5 * SECOND, times=None)
    rig.bus.faults = FaultScript([away])
    watch = rig.watch(8 * SECOND)
    assert rig.reported
    assert any(at > 5 * SECOND for at, _ in rig.shown)
    assert watch.values < 40


def test_a_magnetometer_is_hidden_again_when_it_was_read_through_the_bypass() -> None:
    rig = Rig("ak8963", TrialPace())
    rig.watch(SECOND)
    with pytest.raises(NoAcknowledge):
        rig.bus.read(0x0C, 1)
