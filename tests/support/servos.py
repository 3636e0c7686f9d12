"""A servo as boards state one: a radian to each side, two radians a second."""

from typing import Final

from firmware_drivers.servo import Servo, ServosSettings

from firmware_runtime.devs.time import MILLISECOND, NEVER

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
