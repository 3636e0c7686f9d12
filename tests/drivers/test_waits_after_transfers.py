"""A driver waits from the end of the transfer, and on doubles a wait too short fails."""

from collections.abc import Callable
from itertools import pairwise
from typing import TypeAlias

import pytest
from firmware_drivers.chips.bearing import Bearing
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.step import Step
from firmware_drivers.compass import ONCE, Compass, CompassSettings
from firmware_drivers.esc import Esc, EscSettings
from firmware_drivers.sonar import Sonar, SonarSettings

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.executive.clocks import Clock, OutsideClock, VirtualClock, WorldClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.hal.accounted_bus import AccountedBus
from firmware_runtime.hal.budget import transaction_ns
from firmware_runtime.hal.served.client import ServedBus
from firmware_runtime.hal.served.packets import Answered, Asked, Done, Transfer
from firmware_runtime.hal.wire_errors import Fault
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import FollowingClock, ManualClock
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.adc import (
    CONVERSION,
    READING,
    Adc,
    AdcDouble,
    HastySampler,
    PatientSampler,
    Sampler,
)
from tests.support.atomic_bench import AtomicBench
from tests.support.scripted_chip import ScriptedChip
from tests.support.stalling_clock import StallingClock
from tests.support.virtual_tachobot import virtual_tachobot

TAKES = 3
"""Ms that the transfers of every step take."""


class SlowSonar(ScriptedChip):
    ranging_ns = 36 * MILLISECOND
    interval_ns = 65 * MILLISECOND
    nearest_m = 0.03

    def __init__(self) -> None:
        super().__init__()
        self.line.takes = TAKES * MILLISECOND

    def bring_up(self) -> tuple[Step, ...]:
        return (
            Step("first", lambda: self.answer("first", [None]), 0),
            Step("second", lambda: self.answer("second", [None]), 10 * MILLISECOND),
            Step("third", lambda: self.answer("third", [None]), 0),
        )

    def start_ranging(self) -> None:
        self.answer("ping", [None])

    def read_distance(self) -> float:
        return self.answer("read", [1.0])


class SlowCompass(ScriptedChip):
    def __init__(self) -> None:
        super().__init__()
        self.line.takes = TAKES * MILLISECOND
        start = Step("measure", lambda: self.answer("start", [None]), 6 * MILLISECOND)
        self.measurement = (start,)

    def bring_up(self) -> tuple[Step, ...]:
        return ()

    def read_bearing(self) -> Bearing:
        return self.answer("read", [Bearing(90.0, None)])


def bench_of(model: Sonar | Compass, chip: ScriptedChip) -> AtomicBench:
    bench = AtomicBench(model)
    chip.now = lambda: bench.simulator.now
    return bench


def sonar_with(period_ms: int) -> tuple[AtomicBench, SlowSonar]:
    chip = SlowSonar()
    settings = SonarSettings(period_ms * MILLISECOND, threshold_m=0.5)
    return bench_of(Sonar("sonar", chip, settings), chip), chip


def test_a_step_of_the_bring_up_is_waited_for_from_its_end_and_others_follow_at_once() -> None:
    bench, chip = sonar_with(100)
    bench.run(100)
    assert chip.calls == [("first", 0), ("second", 0), ("third", TAKES + 10)]


def test_a_ranging_is_waited_for_from_the_end_of_the_ping_and_the_period_stays() -> None:
    bench, chip = sonar_with(100)
    bench.put(50, start=1)
    bench.run(300)
    assert chip.times("ping") == [50, 150, 250]
    assert chip.times("read") == [86 + TAKES, 186 + TAKES, 286 + TAKES]


def test_no_ping_comes_sooner_after_the_end_of_the_last_than_the_chip_needs() -> None:
    bench, chip = sonar_with(65)
    bench.put(50, start=1)
    bench.run(1000)
    intervals = {after - before for before, after in pairwise(chip.times("ping"))}
    assert intervals == {65 + TAKES}


def test_a_measurement_is_waited_for_from_the_end_of_its_start() -> None:
    chip = SlowCompass()
    model = Compass("compass", chip, CompassSettings(period=100 * MILLISECOND))
    bench = bench_of(model, chip)
    bench.put(50, request=ONCE)
    bench.run(100)
    assert chip.calls == [("start", 50), ("read", 50 + TAKES + 6)]


def test_an_esc_has_its_low_pulse_for_the_whole_time_of_arming() -> None:
    simulated: list[AtomicBench] = []
    clock = FollowingClock(lambda: simulated[0].simulator.now if simulated else 0)
    double = Pca9685Double(clock)
    bus = I2cBusDouble("i2c1", clock, [double], bus_hz=10_000, reach=clock.reach)
    settings = EscSettings(0, 50.0, 1000.0, 2000.0, arming=3 * SECOND)
    bench = AtomicBench(Esc("esc", Pca9685(AccountedBus(bus, 10_000, time=clock)), settings))
    simulated.append(bench)
    bench.put(200, arm=True)
    low_since = clock()
    assert low_since > 200 * MILLISECOND
    bench.run(4000)
    ((armed_at, armed),) = bench.said["armed"]
    assert armed
    assert armed_at * MILLISECOND == low_since + 3 * SECOND


@pytest.mark.slow
def test_the_whole_robot_gives_its_chips_the_time_they_need_on_a_slow_bus() -> None:
    """At 100 kHz a bring-up step is some tenths of a millisecond on the wire."""
    robot = virtual_tachobot("buses.i2c1.speed_hz=100000", "controller.period_s=0.02")
    robot.run(2)
    assert robot.values("imu.sample")
    assert robot.faults() == []
    bench = robot.rig
    assert [*bench.imu.warnings, *bench.magnetometer.warnings, *bench.thrust.warnings] == []


BUS_HZ = 100_000
STARTING = transaction_ns((bytes(3),), BUS_HZ)

Said: TypeAlias = list[tuple[int, object]]
Kind: TypeAlias = type[Sampler]


def run(kind: Kind, bus: AccountedBus, world: WorldClock, clock: Clock) -> Said:
    """Run a sampler on a bus; return readings and faults with their instants."""
    said: Said = []
    model = kind(Adc(bus))
    executive = Executive(model, clock, list, world_now=world)
    executive.simulator.listen(model.reading_out, lambda at, value: said.append((at, value)))
    executive.simulator.listen(model.fault_out, lambda at, fault: said.append((at, fault)))
    assert executive.run(SECOND).error is None
    return said


def in_process(kind: Kind, clock: Clock | None = None) -> Said:
    """On doubles in this process, in virtual time or on another clock."""
    world = WorldClock()
    double = I2cBusDouble("i2c1", world, [AdcDouble(world)], bus_hz=BUS_HZ, reach=world.reach)
    bus = AccountedBus(double, BUS_HZ, time=world)
    return run(kind, bus, world, clock or VirtualClock())


def served(kind: Kind) -> Said:
    """On doubles with a clock of their own, as in another process; both clocks go alike."""
    clock, theirs = VirtualClock(), ManualClock()
    double = I2cBusDouble("i2c1", theirs, [AdcDouble(theirs)], bus_hz=BUS_HZ, reach=theirs.reach)

    def ask(asked: Asked, _where: str) -> Answered:
        assert isinstance(asked, Transfer)
        theirs.reach(clock.now())
        return Done(double.transfer(asked.address, asked.messages))

    world = OutsideClock(clock.now)
    bus = AccountedBus(ServedBus("i2c1", ask), BUS_HZ, time=world)
    return run(kind, bus, world, clock)


@pytest.mark.parametrize("on_doubles", [in_process, served])
def test_a_model_that_counts_from_its_activation_gets_faults_and_from_the_transfer_samples(
    on_doubles: Callable[[Kind], Said],
) -> None:
    hasty, patient = ([value for _, value in on_doubles(k)] for k in (HastySampler, PatientSampler))
    assert min(len(hasty), len(patient)) > 400
    assert all(isinstance(value, Fault) and value.kind == "NotReady" for value in hasty)
    assert set(patient) == {READING}


def test_the_wait_is_the_time_on_the_wire_and_the_conversion_and_a_bus_held_up_before_counts() -> (
    None
):
    """The transfer that reads one conversion delays the one that starts the next."""
    first, second, *_ = (at for at, _ in in_process(PatientSampler))
    assert first == STARTING + CONVERSION
    assert second - first == transaction_ns((bytes(1), 2), BUS_HZ) + STARTING + CONVERSION


def test_a_run_that_is_late_within_tolerance_gives_the_very_samples_of_virtual_time() -> None:
    stalls = dict.fromkeys(range(2000), MILLISECOND // 3)
    assert in_process(PatientSampler, StallingClock(stalls)) == in_process(PatientSampler)


def test_after_a_late_start_the_chip_is_still_given_its_time() -> None:
    stalls = dict.fromkeys(range(0, 300, 7), 5 * MILLISECOND)
    said = [value for _, value in in_process(PatientSampler, StallingClock(stalls))]
    assert set(said) == {READING}
