"""A model that waits for its chip counts from the end of the transfer, not from its activation."""

from itertools import pairwise

import pytest
from firmware_drivers.chips.bearing import Bearing
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.chips.step import Step
from firmware_drivers.compass import ONCE, Compass, CompassSettings
from firmware_drivers.esc import Esc, EscSettings
from firmware_drivers.sonar import Sonar, SonarSettings

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.accounted_bus import AccountedBus
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.clock import FollowingClock
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.atomic_bench import AtomicBench
from tests.support.scripted_chip import ScriptedChip
from tests.support.virtual_tachobot import virtual_tachobot

TAKES = 3
"""Ms that the transfers of every step take."""


class SlowSonar(ScriptedChip):
    ranging_ns = 36 * MILLISECOND
    interval_ns = 65 * MILLISECOND

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
