import math
from dataclasses import replace

import pytest
from firmware_drivers.chips.pca9685 import Pca9685
from firmware_drivers.servo import FASTEST_HZ, SLOWEST_HZ, Servo, Servos, ServosSettings

from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.errors import SettingError
from firmware_runtime.hal.budget import bits
from sim_doubles.i2c_bus import I2cBusDouble
from sim_doubles.worlds.servo import ServoParameters, ServoPlant, pulse_of
from tests.support.pca9685_bench import Pca9685Bench
from tests.support.servos import PAN, servos_settings
from tests.support.wire import sentences

TILT = Servo(
    name="tilt",
    channel=5,
    least_rad=0.0,
    most_rad=0.5,
    least_pulse_us=2000.0,
    most_pulse_us=1500.0,
    slew_rad_s=100.0,
)


class Bench(Pca9685Bench):
    """Two servos on a PCA9685 double, and the plant that one of them turns."""

    def __init__(self, timeout: int = NEVER) -> None:
        settings = servos_settings(PAN, TILT, timeout=timeout)
        super().__init__(lambda chip, interlock: Servos("head", chip, settings, interlock))
        assert isinstance(self.actuator, Servos)
        self.servos = self.actuator
        self.plant = ServoPlant(
            ServoParameters(least_pulse_us=1000.0, most_pulse_us=2000.0), pulse_of(self.double, 2)
        )
        self.double.before_change = lambda: self.plant.advance(self.now())

    def pulse(self, servo: Servo) -> str:
        return f"{round(pulse_of(self.double, servo.channel)() / 10) * 10}"

    @property
    def pan_us(self) -> str:
        return self.pulse(PAN)

    @property
    def tilt_us(self) -> str:
        return self.pulse(TILT)


@pytest.fixture
def bench() -> Bench:
    return Bench()


@sentences(
    {
        "all are limp until a command comes, and then only that one is driven": (
            "1000; off is True; 1000 pan=0.5; pan_us is 1750; tilt_us is 0; consecutive is ()"
        ),
        "upside down, the longer pulse is at the lesser angle": "100 tilt=0.1; tilt_us is 1900",
        "a command is cut to the upper limit": "100 pan=9.0; pan_us is 2000",
        "a command is cut to the lower limit": "100 pan=-9.0; pan_us is 1000",
        "a release makes limp also what stood beside a servo that is told where to go with it": (
            "100 pan=0.2 tilt=0.3; 200 release=True pan=0.1; tilt_us is 0; pan_us is 1600; "
            "1000; tilt_us is 0; pan_us is 1550; 1000 tilt=0.1; tilt_us is 1900; consecutive is ()"
        ),
        "what is no angle makes all limp": (
            "100 pan=0.2; 200 tilt=nan; off is True; consecutive is 1"
        ),
        "the interlock turns all off and the command waits for it": (
            "100 pan=0.2; switch; 130; off is True; 500 pan=-0.2; 1000; off is True; switch; 2000; "
            "pan_us is 1400"
        ),
        "after a loss of power the chip gets its command again": (
            "100 pan=0.2; power cycle; 1000; pan_us is 1600; consecutive is 1"
        ),
        "a refused stop is no longer counted once the chip is up again": (
            "100 pan=0.2; 200; refuse 1; switch; 400; refuse 1; switch; 1000; consecutive is 1 1"
        ),
        "after a refusal the chip gets its command again": (
            "100 pan=0.2; refuse 1; 1000; pan_us is 1600; consecutive is 1"
        ),
    }
)
def test_commands_become_pulses(bench: Bench, lines: str) -> None:
    bench.play(lines)


def test_without_a_new_command_for_the_timeout_all_go_limp() -> None:
    bench = Bench(timeout=500 * MILLISECOND)
    bench.play("100 pan=0.2; 590; off is False; 640; off is True; consecutive is 1")
    bench.play("700 pan=0.2; pan_us is 1600")


def test_a_chip_that_a_probe_has_just_woken_is_brought_up_once_its_oscillator_runs(
    bench: Bench,
) -> None:
    bench.servos.chip.silence()
    bench.servos.chip.identify()
    bench.play("100 pan=0.5; pan_us is 1750")
    assert bench.double.warnings == []


def test_the_angle_changes_no_faster_than_the_slew_however_often_commands_come(
    bench: Bench,
) -> None:
    bench.put(100, pan=-1.0)
    for at_ms in range(200, 700, 31):
        bench.put(at_ms, pan=1.0)
        expected = -1.0 + 2.0 * (at_ms - 200) / 1000
        assert bench.servos.written["pan"] == pytest.approx(expected, abs=0.05)
    bench.run(1096)
    assert bench.servos.written["pan"] == pytest.approx(-1.0 + 2.0 * 0.896, abs=1e-9)
    bench.run(1300)
    assert bench.servos.written["pan"] == 1.0
    bench.play("1300; pan_us is 2000")


def test_the_plant_follows_and_holds(bench: Bench) -> None:
    bench.put(100, pan=1.0)
    for at_ms, command in ((400, {"release": True}), (600, {"release": True})):
        bench.run(at_ms)
        assert bench.plant.angle_rad(bench.now()) == pytest.approx(math.pi / 2, abs=0.02)
        bench.put(at_ms, **command)
        assert bench.double.all_off
    assert bench.faults == []


def test_the_plant_stands_at_its_start_until_time_has_passed() -> None:
    plant = ServoPlant(ServoParameters(start_rad=0.3), lambda: 2500.0)
    assert plant.angle_rad(0) == 0.3


def test_the_end_leaves_everything_off(bench: Bench) -> None:
    bench.put(100, pan=0.2, tilt=0.3)
    bench.servos.exit()
    assert bench.double.all_off


def test_the_traffic_stated_is_that_of_a_period_and_of_a_command(bench: Bench) -> None:
    bench.put(100, pan=0.2, tilt=0.3)
    before = bench.bus.bits
    bench.run(120)
    once = sum(map(bits, servos_settings(PAN, TILT).traffic))
    assert bench.bus.bits - before == once
    bench.put(130, pan=0.1, tilt=0.3)
    assert bench.bus.bits - before == 2 * once
    bench.put(150, pan=0.2, tilt=0.3)  # at the instant at which the pulses are due again
    assert bench.bus.bits - before == 4 * once


def test_the_slowest_and_the_fastest_pulse_rate_are_sound_and_a_slow_servo_is() -> None:
    for rate_hz in (SLOWEST_HZ, FASTEST_HZ):
        assert ServosSettings(servos=(PAN,), frequency_hz=rate_hz, period=1).faults() == []
    assert servos_settings(replace(PAN, slew_rad_s=0.01)).faults() == []


WRONG = Servo(
    name="pan",
    channel=16,
    least_rad=1.0,
    most_rad=1.0,
    least_pulse_us=0.0,
    most_pulse_us=30_000.0,
    slew_rad_s=0.0,
)


LONG = replace(PAN, most_pulse_us=2480.0)
"""It fits into a cycle of 400 Hz, and not into one of the 406.9 Hz that the chip makes of them."""
NO_NUMBERS = [
    *((replace(PAN, slew_rad_s=number), "slew_rad_s") for number in (math.inf, math.nan)),
    *((replace(PAN, least_rad=number), "least_rad") for number in (-math.inf, math.nan)),
    *((replace(PAN, most_rad=number), "most_rad") for number in (math.inf, math.nan)),
    *((replace(PAN, most_pulse_us=number), "most_pulse_us") for number in (math.inf, math.nan)),
]


@pytest.mark.parametrize(
    ("settings", "keys"),
    [
        (
            ServosSettings(servos=(PAN, WRONG), frequency_hz=50.0, period=0, timeout=-1),
            "pan.channel least_rad slew_rad_s least_pulse_us most_pulse_us name period timeout",
        ),
        (ServosSettings(servos=(PAN,), frequency_hz=1000.0, period=1), "frequency_hz"),
        (ServosSettings(servos=(), frequency_hz=50.0, period=1), "servos"),
        (ServosSettings(servos=(LONG,), frequency_hz=400.0, period=1), "most_pulse_us"),
        *((servos_settings(servo), key) for servo, key in NO_NUMBERS),
    ],
)
def test_every_wrong_setting_is_named(settings: ServosSettings, keys: str) -> None:
    assert len(settings.faults()) == len(keys.split())
    for fault, key in zip(settings.faults(), keys.split(), strict=True):
        assert key in fault.partition(":")[0]
    with pytest.raises(SettingError, match=keys.split(maxsplit=1)[0]):
        Servos("head", Pca9685(I2cBusDouble("i2c1", lambda: 0, [])), settings)
