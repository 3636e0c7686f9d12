import struct

import pytest
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.esc import Esc, EscSettings

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.wire_errors import Fault
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble

LOW, HALF, FULL = 0.05, 0.075, 0.1
"""Duties of 1000, 1500 and 2000 us at 50 Hz."""


class Bench:
    """An ESC on a PCA9685 double; commands come in by hand."""

    def __init__(self, timeout: int = NEVER) -> None:
        self.simulator: Simulator | None = None
        self.chip = Pca9685Double(self.now)
        self.bus = I2cBusDouble("i2c1", self.now, [self.chip])
        top = Coupled("top")
        esc = EscSettings(
            channel=3,
            frequency_hz=50.0,
            low_pulse_us=1000.0,
            high_pulse_us=2000.0,
            arming=3 * SECOND,
            timeout=timeout,
        )
        self.model = top.add(Esc("esc", Pca9685(self.bus), esc))
        self.arm, self.throttle = top.in_port("arm", bool), top.in_port("throttle", float)
        top.couple(self.arm, self.model.arm)
        top.couple(self.throttle, self.model.throttle)
        self.simulator = Simulator(top, checked=True)
        self.armed: list[tuple[int, bool]] = []
        self.faults: list[Fault] = []
        self.simulator.listen(
            self.model.armed_out, lambda at, value: self.armed.append((at // MILLISECOND, value))
        )
        self.simulator.listen(self.model.fault_out, lambda _at, value: self.faults.append(value))

    def now(self) -> int:
        return 0 if self.simulator is None else self.simulator.now

    def run(self, until_ms: int) -> None:
        assert self.simulator is not None
        self.simulator.run(until_ms * MILLISECOND)

    def command(
        self, at_ms: int, *, arm: bool | None = None, throttle: float | None = None
    ) -> None:
        assert self.simulator is not None
        self.run(at_ms)
        if arm is not None:
            self.simulator.inject(self.arm, arm)
        if throttle is not None:
            self.simulator.inject(self.throttle, throttle)
        self.simulator.advance(at_ms * MILLISECOND)

    @property
    def duty(self) -> float:
        return self.chip.duty(3)


def close(duty: float) -> object:
    return pytest.approx(duty, abs=1e-4)


def test_it_is_off_until_it_is_commanded_to_arm() -> None:
    bench = Bench()
    bench.command(1000, throttle=1.0)
    bench.run(5000)
    assert bench.chip.all_off
    assert bench.armed == []


def test_arming_holds_the_low_pulse_for_its_time_and_then_says_so() -> None:
    bench = Bench()
    bench.command(1000, arm=True)
    assert bench.duty == close(LOW)
    bench.command(2000, throttle=1.0)
    assert bench.duty == close(LOW)
    bench.run(3999)
    assert bench.armed == []
    bench.run(4000)
    assert bench.armed == [(4000, True)]


def test_a_command_to_arm_during_bring_up_is_kept() -> None:
    bench = Bench()
    bench.command(0, arm=True)
    bench.run(200)
    assert bench.duty == close(LOW)


def test_throttle_is_obeyed_once_armed_and_clipped_to_its_range() -> None:
    bench = Bench()
    bench.command(1000, arm=True)
    for at_ms, throttle, duty in ((5000, 0.5, HALF), (6000, 7.0, FULL), (7000, -1.0, LOW)):
        bench.command(at_ms, throttle=throttle)
        assert bench.duty == close(duty)


def test_disarming_ends_in_no_signal_at_all() -> None:
    bench = Bench()
    bench.command(1000, arm=True)
    bench.command(5000, throttle=0.5)
    bench.command(6000, arm=False)
    assert bench.chip.all_off
    assert bench.armed == [(4000, True), (6000, False)]


def test_the_low_pulse_comes_before_no_signal() -> None:
    bench = Bench()
    bench.command(1000, arm=True)
    bench.command(5000, throttle=0.5)
    bench.command(6000, arm=False)
    low, *off = (each.messages[0] for each in list(bench.bus.log)[-3:])
    assert isinstance(low, bytes)
    register, on, switched_off = struct.unpack("<B2H", low)
    assert register == 0x06 + 4 * 3
    assert (switched_off - on) % 4096 / 4096 == pytest.approx(LOW, abs=1e-3)
    assert off == [bytes([0x01, 0x04]), bytes([0xFD, 0x10])]


def test_a_throttle_that_is_no_number_disarms() -> None:
    bench = Bench()
    bench.command(1000, arm=True)
    bench.command(5000, throttle=float("nan"))
    assert bench.chip.all_off
    assert bench.armed[-1] == (5000, False)
    assert "throttle nan" in bench.faults[0].reason


def test_a_silent_chip_is_stopped_again_and_again_until_it_answers() -> None:
    bench = Bench()
    bench.command(1000, arm=True)
    bench.command(5000, throttle=0.5)
    bench.bus.faults = FaultScript([NackAddress(times=4)])
    bench.command(6000, throttle=0.6)
    assert bench.armed[-1] == (6000, False)
    assert not bench.chip.all_off
    bench.run(6100)
    assert bench.chip.all_off
    assert {fault.kind for fault in bench.faults} == {"NoAcknowledge"}


def test_a_chip_that_lost_its_supply_disarms_within_a_second_and_is_brought_up() -> None:
    bench = Bench()
    bench.command(1000, arm=True)
    bench.command(5000, throttle=0.5)
    bench.chip.power_cycle()
    bench.run(6000)
    assert bench.armed == [(4000, True), (6000, False)]
    assert "read 11 11 1e, expected 20 04 79" in bench.faults[0].reason
    bench.command(7000, arm=True)
    bench.run(10_000)
    assert bench.duty == close(LOW)
    assert bench.armed[-1] == (10_000, True)


def test_throttle_that_keeps_coming_delays_no_poll() -> None:
    bench = Bench()
    bench.command(1000, arm=True)
    bench.run(4500)
    bench.chip.power_cycle()
    for at_ms in range(4500, 5500, 10):
        bench.command(at_ms, throttle=0.5)
    assert [at_ms for at_ms, is_armed in bench.armed if not is_armed] == [5000]


def test_a_command_in_between_delays_no_poll() -> None:
    bench = Bench()
    bench.command(1000, arm=True)
    bench.command(4400, throttle=0.5)
    bench.chip.power_cycle()
    bench.run(4999)
    assert bench.armed == [(4000, True)]
    bench.run(5000)
    assert bench.armed == [(4000, True), (5000, False)]


def test_the_first_poll_is_a_second_after_arming_however_long_it_was_armed_before() -> None:
    bench = Bench()
    bench.command(1000, arm=True)
    bench.command(4700, throttle=0.5)
    bench.command(4700, arm=False)
    bench.command(5000, arm=True)
    bench.run(8100)
    bench.chip.power_cycle()
    bench.run(8999)
    assert bench.armed[-1] == (8000, True)
    bench.run(9000)
    assert bench.armed[-1] == (9000, False)


def test_a_chip_that_lost_its_supply_is_not_armed() -> None:
    bench = Bench()
    bench.run(1000)
    bench.chip.power_cycle()
    bench.command(2000, arm=True)
    bench.run(6000)
    assert bench.armed == [(2000, False)]
    assert bench.chip.running


def test_it_can_be_armed_again_after_a_fault() -> None:
    bench = Bench()
    bench.command(1000, arm=True)
    bench.command(5000, throttle=float("inf"))
    bench.command(6000, arm=True)
    bench.run(9000)
    assert bench.armed == [(4000, True), (5000, False), (9000, True)]


def test_a_controller_that_falls_silent_disarms_after_the_timeout_and_no_sooner() -> None:
    bench = Bench(timeout=100 * MILLISECOND)
    bench.command(1000, arm=True)
    bench.command(4050, throttle=0.5)
    bench.command(4140, throttle=0.6)
    bench.command(4200, arm=True)
    bench.run(4239)
    assert not bench.chip.all_off
    bench.run(4240)
    assert (bench.chip.all_off, bench.armed) == (True, [(4000, True), (4240, False)])
    assert "no throttle for 0.1 s" in bench.faults[0].reason
    bench.command(5000, arm=True)
    bench.run(8050)
    assert bench.duty == close(LOW)
    assert bench.armed[2:] == [(8000, True)]


def test_without_a_timeout_a_throttle_holds() -> None:
    bench = Bench()
    bench.command(1000, arm=True)
    bench.command(5000, throttle=0.5)
    bench.run(60_000)
    assert bench.duty == close(HALF)


@pytest.mark.parametrize(
    ("key", "settings"),
    [
        ("channel", EscSettings(16, 50.0, 1000.0, 2000.0, 0)),
        ("frequency_hz", EscSettings(0, float("nan"), 1000.0, 2000.0, 0)),
        ("low_pulse_us", EscSettings(0, 50.0, 2000.0, 1000.0, 0)),
        ("low_pulse_us", EscSettings(0, 50.0, 0.0, 2000.0, 0)),
        ("high_pulse_us", EscSettings(0, 500.0, 1000.0, 2000.0, 0)),
        ("arming", EscSettings(0, 50.0, 1000.0, 2000.0, -1)),
        ("timeout", EscSettings(0, 50.0, 1000.0, 2000.0, 0, timeout=0)),
    ],
)
def test_what_would_not_arm_with_the_motor_still_is_refused(
    key: str, settings: EscSettings
) -> None:
    bus = I2cBusDouble("i2c1", lambda: 0, [])
    with pytest.raises(SettingError, match=f"esc on PCA9685 at 0x40 on i2c1: .*{key}"):
        Esc("esc", Pca9685(bus), settings)
