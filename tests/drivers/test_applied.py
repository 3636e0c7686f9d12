"""What actuators say that they apply of their commands: when it changes, and at once."""

from collections.abc import Callable

import pytest
from firmware_drivers.actuator import Actuator
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.esc import Esc, EscSettings
from firmware_drivers.servo import Servo, Servos, ServosSettings
from firmware_drivers.thrust_pairs import Forces, ThrustPairs, ThrustSettings
from firmware_drivers.treads import Treads, TreadSettings, TreadSpeeds

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.models.motion import Applied, LeastApplied
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.scripted_treads import ScriptedDriver
from tests.support.servos import PAN

NOTHING, PART, ALL = Applied
TILT = Servo(
    name="tilt",
    channel=3,
    least_rad=-1.0,
    most_rad=1.0,
    least_pulse_us=1000.0,
    most_pulse_us=2000.0,
    slew_rad_s=2.0,
)


class Bench:
    """An actuator on a double, its interlock a switch, and what it said it applies."""

    def __init__(self, build: Callable[[Pca9685, Callable[[], bool]], Actuator]) -> None:
        self.simulator: Simulator | None = None
        self.enabled = True
        self.chip = Pca9685Double(self.now)
        self.bus = I2cBusDouble("i2c1", self.now, [self.chip])
        self.model = build(Pca9685(self.bus), lambda: self.enabled)
        self.simulator = Simulator(self.model, checked=True)
        self.said: list[tuple[int, Applied]] = []
        self.simulator.listen(
            self.model.applied_out, lambda at, applied: self.said.append((at, applied))
        )

    def now(self) -> int:
        return 0 if self.simulator is None else self.simulator.now

    def run(self, until_ms: int) -> None:
        assert self.simulator is not None
        self.simulator.run(until_ms * MILLISECOND)

    def put(self, at_ms: int, port: str, value: object) -> None:
        assert self.simulator is not None
        self.run(at_ms)
        self.simulator.inject(self.model.in_ports[port], value)
        self.simulator.advance(at_ms * MILLISECOND)

    @property
    def words(self) -> list[tuple[int, Applied]]:
        """What was said, by the ms."""
        return [(at // MILLISECOND, applied) for at, applied in self.said]


def thrust(slew_per_s: float = 1e6) -> Bench:
    settings = ThrustSettings(0.4, 1000.0, slew_per_s, 50 * MILLISECOND, 0)
    return Bench(lambda chip, interlock: ThrustPairs("thrust", chip, settings, interlock))


def treads() -> Bench:
    settings = TreadSettings(speed=0.5, refresh=200 * MILLISECOND)
    return Bench(lambda _, interlock: Treads("treads", ScriptedDriver(), settings, interlock))


def servos() -> Bench:
    settings = ServosSettings(servos=(PAN, TILT), frequency_hz=50.0, period=20 * MILLISECOND)
    return Bench(lambda chip, interlock: Servos("head", chip, settings, interlock))


def test_an_actuator_applies_nothing_from_the_start_and_all_from_its_first_command() -> None:
    bench = thrust()
    for at_ms in (100, 110, 120):
        bench.put(at_ms, "forces", Forces(0.1, 0.0, 0.2, 0.0))
    assert bench.words == [(0, NOTHING), (100, ALL)]


def test_nothing_is_said_while_nothing_changes_however_many_commands_come() -> None:
    bench = thrust()
    bench.enabled = False
    for at_ms in range(100, 200, 10):
        bench.put(at_ms, "forces", Forces(0.1, 0.0, 0.2, 0.0))
    assert bench.words == [(0, NOTHING)]


def test_forces_beyond_a_pair_and_duties_on_their_way_are_applied_in_part() -> None:
    bench = thrust()
    bench.put(100, "forces", Forces(0.5, 0.0, 0.0, 0.0))
    bench.put(110, "forces", Forces(0.4, 0.0, 0.0, 0.0))
    assert bench.words[1:] == [(100, PART), (110, ALL)]
    slow = thrust(slew_per_s=20.0)
    slow.put(100, "forces", Forces(0.0, 0.0, 0.0, 0.0))
    slow.put(110, "forces", Forces(0.4, 0.0, 0.0, 0.0))
    assert slow.words[1:] == [(100, ALL), (110, PART)]


@pytest.mark.parametrize("silent_ms", [60, 5000])
def test_the_slew_counts_no_time_spent_off(silent_ms: int) -> None:
    bench = thrust(slew_per_s=2.0)
    bench.put(100 + silent_ms, "forces", Forces(0.0, 0.0, 0.0, 0.0))
    assert bench.chip.duties[0] == pytest.approx(0.1, abs=1 / 4096)


@pytest.mark.parametrize("cause", ["interlock", "chip", "silence", "no number"])
def test_whatever_switches_it_off_it_applies_nothing_at_once(cause: str) -> None:
    bench = thrust()
    bench.put(100, "forces", Forces(0.1, 0.1, 0.1, 0.1))
    if cause == "interlock":
        bench.enabled = False
    elif cause == "chip":
        bench.bus.faults = FaultScript([NackAddress(times=2)])
    if cause == "silence":
        bench.run(160)
    else:
        force = float("nan") if cause == "no number" else 0.1
        bench.put(110, "forces", Forces(force, 0.1, 0.1, 0.1))
    assert [applied for _, applied in bench.words] == [NOTHING, ALL, NOTHING]
    assert bench.words[-1][0] == (150 if cause == "silence" else 110)


def test_treads_apply_part_of_speeds_that_were_clipped_and_nothing_while_disabled() -> None:
    bench = treads()
    bench.put(100, "speeds", TreadSpeeds(0.5, 0.5))
    bench.put(110, "speeds", TreadSpeeds(1.5, 0.5))
    bench.enabled = False
    bench.run(200)
    bench.enabled = True
    bench.run(300)
    said = [applied for _, applied in bench.words]
    assert said == [NOTHING, ALL, PART, NOTHING, PART]


def test_driving_treads_notice_within_a_poll_that_they_were_disabled() -> None:
    bench = treads()
    bench.put(100, "speeds", TreadSpeeds(0.5, 0.5))
    bench.run(110)
    bench.enabled = False
    bench.run(131)
    assert bench.words[-1][1] is NOTHING


def test_servos_apply_part_on_their_way_and_at_a_limit_and_nothing_when_limp() -> None:
    bench = servos()
    bench.put(100, "pan", 0.0)
    bench.put(110, "pan", 0.1)
    bench.run(300)
    bench.put(310, "pan", 1.5)
    bench.run(2000)
    bench.put(2010, "release", True)
    said = [applied for _, applied in bench.words]
    assert said == [NOTHING, ALL, PART, ALL, PART, NOTHING]


def test_an_esc_applies_all_once_armed_and_part_of_a_throttle_beyond_1() -> None:
    settings = EscSettings(
        channel=3, frequency_hz=50.0, low_pulse_us=1000.0, high_pulse_us=2000.0, arming=SECOND
    )
    bench = Bench(lambda chip, interlock: Esc("esc", chip, settings, interlock))
    bench.put(100, "arm", True)
    bench.put(1500, "throttle", 1.5)
    bench.put(1600, "throttle", 0.5)
    bench.put(1700, "arm", False)
    assert [applied for _, applied in bench.words] == [NOTHING, ALL, PART, ALL, NOTHING]
    assert [at for at, _ in bench.words][2:] == [1500, 1600, 1700]


def test_of_several_actuators_the_least_counts_and_one_that_said_nothing() -> None:
    top = Coupled("top")
    both = top.add(LeastApplied("both", ["left", "right"]))
    ports = {name: top.in_port(name, Applied) for name in ("left", "right")}
    for name, port in ports.items():
        top.couple(port, both.applied[name])
    simulator = Simulator(top, checked=True)
    said: list[Applied] = []
    simulator.listen(both.least, lambda _, applied: said.append(applied))
    for at, (name, applied) in enumerate(
        [("left", ALL), ("right", PART), ("right", ALL), ("left", NOTHING), ("right", PART)]
    ):
        simulator.inject(ports[name], applied)
        simulator.advance(at * MILLISECOND)
    assert said == [NOTHING, PART, ALL, NOTHING]
