"""An ESC's model on its chip's double: arming, throttle, and what disarms it."""

import struct

import pytest
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.esc import Esc, EscSettings

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import SettingError
from sim_doubles.i2c_bus import I2cBusDouble
from tests.support.pca9685_bench import EscBench, esc_bench
from tests.support.wire import sentences

AHEAD = "1000 arm=True; 5000 throttle=0.5; pulse_us is 1500"


@pytest.fixture
def bench() -> EscBench:
    return esc_bench()


@sentences(
    {
        "it is off until it is commanded to arm": (
            "1000 throttle=1.0; 5000; off is True; armed is (); consecutive is ()"
        ),
        "arming holds the low pulse for its time and then says so": (
            "1000 arm=True; pulse_us is 1000; 2000 throttle=1.0; pulse_us is 1000; 3999; "
            "armed is (); 4000; armed is 4000"
        ),
        "a command to arm during bring-up is kept": "0 arm=True; 200; pulse_us is 1000",
        "throttle is obeyed once armed and clipped to its range": (
            f"{AHEAD}; 6000 throttle=7.0; pulse_us is 2000; 7000 throttle=-1.0; pulse_us is 1000"
        ),
        "without a timeout a throttle holds": f"{AHEAD}; 20000; pulse_us is 1500",
        "disarming ends in no signal at all": (
            f"{AHEAD}; 6000 arm=False; off is True; armed is 4000 -6000; consecutive is ()"
        ),
        "a throttle that is no number disarms, and it can be armed again": (
            "1000 arm=True; 5000 throttle=nan; off is True; armed is 4000 -5000; "
            "6000 arm=True; 9000; "
            "armed is 4000 -5000 9000; 9500 throttle=inf; off is True"
        ),
        "a silent chip is stopped again and again until it answers": (
            f"{AHEAD}; refuse 4; 6000 throttle=0.6; armed is 4000 -6000; pulse_us is 1500; 6100; "
            "off is True"
        ),
        "a chip that lost its supply disarms within a second and is brought up": (
            f"{AHEAD}; power cycle; 6000; armed is 4000 -6000; 7000 arm=True; 10000; "
            "pulse_us is 1000; armed is 4000 -6000 10000"
        ),
        "a command in between delays no poll": (
            "1000 arm=True; 4400 throttle=0.5; power cycle; 4999; armed is 4000; 5000; "
            "armed is 4000 -5000"
        ),
        "the first poll is a second after arming, however long it was armed before": (
            "1000 arm=True; 4700 throttle=0.5; 4700 arm=False; 5000 arm=True; 8100; power cycle; "
            "8999; armed is 4000 -4700 8000; 9000; armed is 4000 -4700 8000 -9000"
        ),
        "a chip that lost its supply is not armed": (
            "1000; power cycle; 2000 arm=True; 6000; armed is -2000; running is True"
        ),
    }
)
def test_an_esc(bench: EscBench, lines: str) -> None:
    bench.play(lines)


def test_the_low_pulse_comes_before_no_signal(bench: EscBench) -> None:
    bench.play(AHEAD, "6000 arm=False")
    low, *off = (each.messages[0] for each in list(bench.bus.log)[-3:])
    assert isinstance(low, bytes)
    register, on, switched_off = struct.unpack("<B2H", low)
    assert register == 0x06 + 4 * 3
    assert (switched_off - on) % 4096 / 4096 == pytest.approx(0.05, abs=1e-3)
    assert off == [bytes([0x01, 0x04]), bytes([0xFD, 0x10])]


def test_throttle_that_keeps_coming_delays_no_poll(bench: EscBench) -> None:
    bench.play("1000 arm=True; 4500; power cycle")
    for at_ms in range(4500, 5500, 10):
        bench.put(at_ms, throttle=0.5)
    bench.play("armed is 4000 -5000")
    assert "read 11 11 1e, expected 20 04 79" in bench.faults[0].reason


def test_without_an_interlock_it_is_polled_each_second_too() -> None:
    settings = EscSettings(3, 50.0, 1000.0, 2000.0, 3 * SECOND)
    bench = EscBench(lambda chip, _: Esc("esc", chip, settings))
    bench.play("1000 arm=True; 4400 throttle=0.5; power cycle; 4999; armed is 4000")
    bench.play("5000; armed is 4000 -5000")


def test_the_end_of_a_run_stops_it_at_once(bench: EscBench) -> None:
    bench.play(AHEAD)
    assert bench.simulator.exit() == []
    bench.play("off is True")


def test_a_controller_that_falls_silent_disarms_after_the_timeout_and_no_sooner() -> None:
    bench = esc_bench(timeout=100 * MILLISECOND)
    bench.play("1000 arm=True; 4050 throttle=0.5; 4140 throttle=0.6; 4200 arm=True; 4239")
    bench.play("off is False; 4240; off is True; armed is 4000 -4240")
    assert "no throttle for 0.1 s" in bench.faults[0].reason
    bench.play("5000 arm=True; 8050; pulse_us is 1000; armed is 4000 -4240 8000")


@pytest.mark.parametrize(
    ("key", "settings"),
    [
        ("channel", EscSettings(16, 50.0, 1000.0, 2000.0, 0)),
        ("frequency_hz", EscSettings(0, float("nan"), 1000.0, 2000.0, 0)),
        ("low_pulse_us", EscSettings(0, 50.0, 2000.0, 1000.0, 0)),
        ("low_pulse_us", EscSettings(0, 50.0, 1500.0, 1500.0, 0)),
        ("low_pulse_us", EscSettings(0, 50.0, 0.0, 2000.0, 0)),
        ("high_pulse_us", EscSettings(0, 500.0, 1000.0, 2000.0, 0)),
        ("less than a cycle, 1966", EscSettings(0, 490.0, 1000.0, 2000.0, 0)),
        ("frequency_hz: .*expected 24 to 1526 Hz", EscSettings(0, 20.0, 1000.0, 2000.0, 0)),
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
