"""A servo as boards state one: a radian to each side, two radians a second."""

from typing import Final

from firmware_drivers.servo import Servo

PAN: Final = Servo(
    name="pan",
    channel=2,
    least_rad=-1.0,
    most_rad=1.0,
    least_pulse_us=1000.0,
    most_pulse_us=2000.0,
    slew_rad_s=2.0,
)
