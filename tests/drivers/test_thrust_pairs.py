import pytest
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.thrust_pairs import Forces, ThrustPairs, ThrustSettings, duties_of
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.hal.wire_errors import Fault
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble

FORCE = st.floats(-1.0, 1.0)


def settings(*, slew_per_s: float = 1e6, first_channel: int = 0) -> ThrustSettings:
    return ThrustSettings(
        pair_thrust_n=0.4,
        frequency_hz=1000.0,
        slew_per_s=slew_per_s,
        timeout=50 * MILLISECOND,
        first_channel=first_channel,
    )


class Bench:
    """Thrust pairs on a PCA9685 double; forces come in by hand."""

    def __init__(self, thrust: ThrustSettings | None = None) -> None:
        self.simulator: Simulator | None = None
        self.chip = Pca9685Double(self.now)
        self.bus = I2cBusDouble("i2c1", self.now, [self.chip])
        top = Coupled("top")
        self.model = top.add(ThrustPairs("thrust", Pca9685(self.bus), thrust or settings()))
        self.forces = top.in_port("forces", Forces)
        top.couple(self.forces, self.model.forces)
        self.simulator = Simulator(top, checked=True)
        self.duties: list[tuple[float, ...]] = []
        self.faults: list[Fault] = []
        self.simulator.listen(self.model.duties_out, lambda _at, value: self.duties.append(value))
        self.simulator.listen(self.model.fault_out, lambda _at, value: self.faults.append(value))

    def now(self) -> int:
        return 0 if self.simulator is None else self.simulator.now

    def run(self, until_ms: int) -> None:
        assert self.simulator is not None
        self.simulator.run(until_ms * MILLISECOND)

    def push(self, at_ms: int, *forces: float) -> None:
        assert self.simulator is not None
        self.simulator.run(at_ms * MILLISECOND)
        self.simulator.inject(self.forces, Forces(*forces))
        self.simulator.advance(at_ms * MILLISECOND)


def test_zero_force_is_both_propellers_at_one_half() -> None:
    assert duties_of(Forces(0, 0, 0, 0), 0.4) == (0.5,) * 8


@given(FORCE, st.floats(0.1, 2.0))
def test_a_pair_gives_the_force_that_was_asked_up_to_its_limit(force: float, most: float) -> None:
    first, second = duties_of(Forces(force, 0, 0, 0), most)[:2]
    assert most * (first**2 - second**2) == pytest.approx(max(-most, min(most, force)))


def test_nothing_turns_until_forces_come() -> None:
    bench = Bench()
    bench.run(1000)
    assert bench.chip.running
    assert bench.chip.all_off
    assert bench.duties == []


def test_forces_before_the_chip_is_up_have_no_effect() -> None:
    bench = Bench()
    bench.push(10, 0.1, 0.1, 0.1, 0.1)
    bench.run(1000)
    assert bench.chip.all_off


def test_forces_become_one_burst_of_duties_on_the_right_channels() -> None:
    bench = Bench(settings(first_channel=4))
    bench.run(100)
    before = bench.bus.transactions
    bench.push(100, 0.4, -0.4, 0.0, 0.2)
    assert bench.bus.transactions == before + 1
    assert bench.chip.duties[4:12] == (1.0, 0.0, 0.0, 1.0, 0.5, 0.5, 0.75, 0.25)
    assert bench.duties == [bench.chip.duties[4:12]]


def test_all_go_off_when_no_forces_come_for_the_timeout() -> None:
    bench = Bench()
    bench.push(100, 0.1, 0.1, 0.1, 0.1)
    bench.run(149)
    assert not bench.chip.all_off
    bench.run(150)
    assert bench.chip.all_off
    assert bench.duties[-1] == (0.0,) * 8
    assert "no forces for 0.05 s" in bench.faults[0].reason


def test_forces_that_come_again_turn_the_propellers_again() -> None:
    bench = Bench()
    bench.push(100, 0.1, 0.1, 0.1, 0.1)
    bench.push(300, 0.1, 0.1, 0.1, 0.1)
    assert not bench.chip.all_off
    assert len(bench.faults) == 1


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_a_force_that_is_no_number_switches_off(bad: float) -> None:
    bench = Bench()
    bench.push(100, 0.1, 0.1, 0.1, 0.1)
    bench.push(110, 0.1, bad, 0.1, 0.1)
    assert bench.chip.all_off
    assert "expected finite numbers" in bench.faults[0].reason


def test_a_burst_that_fails_switches_off_and_a_later_one_recovers() -> None:
    bench = Bench()
    bench.push(100, 0.1, 0.1, 0.1, 0.1)
    bench.bus.faults = FaultScript([NackAddress(times=1)])
    bench.push(110, 0.1, 0.1, 0.1, 0.1)
    assert bench.chip.all_off
    bench.push(120, 0.1, 0.1, 0.1, 0.1)
    assert not bench.chip.all_off
    assert [fault.kind for fault in bench.faults] == ["NoAcknowledge"]


def drive(bench: Bench, from_ms: int, to_ms: int) -> None:
    for at_ms in range(from_ms, to_ms, 10):
        bench.push(at_ms, 0.1, 0.1, 0.1, 0.1)


@pytest.mark.slow
def test_a_chip_that_lost_its_supply_is_reported_within_a_second_and_brought_up() -> None:
    bench = Bench()
    drive(bench, 100, 1500)
    bench.chip.power_cycle()
    drive(bench, 1500, 2500)
    (fault,) = bench.faults
    assert "read 11 11 1e, expected 20 04 05" in fault.reason
    assert (0.0,) * 8 in bench.duties
    assert bench.duties[-1] == bench.chip.duties[:8]
    assert not bench.chip.all_off


@pytest.mark.slow
def test_a_chip_that_was_inverted_is_switched_off_within_a_second_and_brought_up() -> None:
    bench = Bench()
    drive(bench, 100, 1500)
    bench.bus.write(0x40, b"\x01\x14")
    were: list[tuple[float, ...]] = []
    bench.chip.before_change = lambda: were.append(bench.chip.duties)
    drive(bench, 1500, 2500)
    (fault,) = bench.faults
    assert "MODE1, MODE2, PRE_SCALE read 20 14 05, expected 20 04 05" in fault.reason
    assert (0.0,) * 16 in were
    assert any(bench.duties[-1])
    assert bench.duties[-1] == bench.chip.duties[:8]


def test_the_first_burst_after_a_failed_one_is_followed_by_a_poll() -> None:
    bench = Bench()
    drive(bench, 100, 200)
    bench.bus.faults = FaultScript([NackAddress(times=1)])
    bench.push(200, 0.1, 0.1, 0.1, 0.1)
    bench.chip.power_cycle()
    bench.push(210, 0.1, 0.1, 0.1, 0.1)
    assert [fault.kind for fault in bench.faults] == ["NoAcknowledge", "NotReady"]
    assert bench.duties[-1] == (0.0,) * 8


def test_stopping_is_repeated_until_it_is_acknowledged() -> None:
    bench = Bench()
    bench.push(100, 0.1, 0.1, 0.1, 0.1)
    bench.bus.faults = FaultScript([NackAddress(times=3)])
    bench.run(249)
    assert not bench.chip.all_off
    bench.run(300)
    assert bench.chip.all_off
    assert [fault.consecutive for fault in bench.faults][-1] == 4


def test_a_failed_bring_up_is_reported_and_begun_again() -> None:
    bench = Bench()
    bench.bus.faults = FaultScript([NackAddress(times=2)])
    bench.run(199)
    assert [fault.kind for fault in bench.faults] == ["NoAcknowledge"] * 2
    assert not bench.chip.running
    bench.run(400)
    assert bench.chip.running


def test_a_duty_changes_no_faster_than_the_slew() -> None:
    bench = Bench(settings(slew_per_s=10.0))
    bench.push(100, 0.0, 0.0, 0.0, 0.0)
    assert bench.chip.duties[:2] == (0.5, 0.5)
    bench.push(110, 0.4, 0.0, 0.0, 0.0)
    assert bench.chip.duties[:2] == pytest.approx((0.6, 0.4), abs=1 / 4096)
    bench.push(140, 0.4, 0.0, 0.0, 0.0)
    assert bench.chip.duties[:2] == pytest.approx((0.9, 0.1), abs=1 / 4096)


def test_exit_leaves_all_channels_off() -> None:
    bench = Bench()
    bench.push(100, 0.1, 0.1, 0.1, 0.1)
    assert bench.simulator is not None
    assert bench.simulator.exit() == []
    assert bench.chip.all_off
