"""A servo as boards state one: a radian to each side, two radians a second; two on a chip."""

from typing import Final

from firmware_drivers.servo import Servo, Servos, ServosSettings

from firmware_runtime.devs.time import MILLISECOND, NEVER
from tests.support.pca9685_bench import Pca9685Bench

PAN: Final = Servo(
    name="pan",
    channel=2,
    least_rad=-1.0,
    most_rad=1.0,
    least_pulse_us=1000.0,
    most_pulse_us=2000.0,
    slew_rad_s=2.0,
)


def servos_settings(*servos: Servo, timeout: int = NEVER) -> ServosSettings:
    """Return servos at 50 Hz."""
    return ServosSettings(
        servos=servos, frequency_hz=50.0, period=20 * MILLISECOND, timeout=timeout
    )


def servos_bench(*servos: Servo, timeout: int = NEVER) -> Pca9685Bench:
    settings = servos_settings(*servos, timeout=timeout)
    return Pca9685Bench(lambda chip, interlock: Servos("head", chip, settings, interlock))
