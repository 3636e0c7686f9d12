import pytest
from firmware_drivers.chips.h_bridge import HBridge
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.radar_motor import RadarMotor, RadarMotorSettings

from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import SettingError
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.atomic_bench import AtomicBench

PWM, IN1, IN2 = 8, 9, 10


class Radar:
    """A radar motor on a PCA9685 double."""

    def __init__(self, longest_turn: int = NEVER) -> None:
        self.bench: AtomicBench | None = None
        self.double = Pca9685Double(self.now)
        self.bus = I2cBusDouble("i2c1", self.now, [self.double])
        bridge = HBridge(Pca9685(self.bus), PWM, IN1, IN2)
        settings = RadarMotorSettings(duty=0.25, frequency_hz=1000.0, longest_turn=longest_turn)
        self.bench = AtomicBench(RadarMotor("motor1", bridge, settings))

    def now(self) -> int:
        return 0 if self.bench is None else self.bench.simulator.now

    def turn(self, at_ms: float, signal: int) -> AtomicBench:
        assert self.bench is not None
        self.bench.put(at_ms, turn=signal)
        self.bench.run(at_ms)
        return self.bench

    @property
    def levels(self) -> tuple[float, ...]:
        """PWM, IN1 and IN2."""
        return self.double.duties[PWM : IN2 + 1]


@pytest.fixture
def radar() -> Radar:
    return Radar()


FORWARD, REVERSE, BRAKE, OFF = (0.25, 1, 0), (0.25, 0, 1), (1, 1, 1), (0, 0, 0)


def test_signals_turn_both_ways_and_brake(radar: Radar) -> None:
    for at_ms, signal, levels in ((100, 1, FORWARD), (200, 2, REVERSE), (300, 0, BRAKE)):
        radar.turn(at_ms, signal)
        assert radar.levels == levels


def test_each_signal_is_a_poll_of_two_and_one_burst_and_nothing_is_refreshed(radar: Radar) -> None:
    bench = radar.turn(100, 0)
    before = radar.bus.transactions
    radar.turn(200, 1)
    bench.run(10_000)
    assert radar.bus.transactions == before + 3


def test_a_signal_during_bring_up_is_kept(radar: Radar) -> None:
    bench = radar.turn(5, 1)
    assert radar.levels == OFF
    bench.run(100)
    assert radar.levels == FORWARD


def test_a_signal_that_is_none_switches_off_and_says_so(radar: Radar) -> None:
    radar.turn(100, 1)
    bench = radar.turn(200, 3)
    assert radar.double.all_off
    assert "motor1.turn: signal 3, expected 0, 1 or 2" in bench.faults[0].reason


def test_a_silent_chip_is_switched_off_again_and_again_and_then_brought_up(radar: Radar) -> None:
    radar.turn(100, 1)
    radar.bus.faults = FaultScript([NackAddress(times=3)])
    bench = radar.turn(200, 2)
    assert radar.levels == FORWARD
    bench.run(299)
    assert radar.levels == FORWARD
    bench.run(300)
    assert radar.double.all_off
    radar.turn(400, 2)
    assert radar.levels == REVERSE
    assert [fault.kind for fault in bench.faults] == ["NoAcknowledge"] * 3


def test_a_chip_that_lost_its_supply_is_reported_at_the_next_signal_and_brought_up(
    radar: Radar,
) -> None:
    radar.turn(100, 1)
    radar.double.power_cycle()
    bench = radar.turn(200, 2)
    assert radar.double.all_off
    assert "read 11 11 1e, expected 20 04 05" in bench.faults[0].reason
    radar.turn(400, 2)
    assert radar.levels == REVERSE


def test_a_head_that_turns_for_too_long_is_switched_off() -> None:
    radar = Radar(longest_turn=5 * SECOND)
    bench = radar.turn(1000, 1)
    bench.run(5999)
    assert radar.levels == FORWARD
    bench.run(6000)
    assert radar.double.all_off
    assert bench.faults[0].reason == "motor1: no command for 5 s; stopped"


def test_exit_leaves_all_channels_off(radar: Radar) -> None:
    bench = radar.turn(100, 1)
    assert bench.simulator.exit() == []
    assert radar.double.all_off


@pytest.mark.parametrize(("duty", "longest_turn"), [(0.0, SECOND), (1.5, SECOND), (0.5, 0)])
def test_settings_that_cannot_be_are_refused(radar: Radar, duty: float, longest_turn: int) -> None:
    bridge = HBridge(Pca9685(radar.bus), PWM, IN1, IN2)
    settings = RadarMotorSettings(duty=duty, frequency_hz=1000.0, longest_turn=longest_turn)
    with pytest.raises(SettingError, match=r"motor1 on H-bridge on channels 8, 9, 10 of PCA9685"):
        RadarMotor("motor1", bridge, settings)
