"""The PWM rate of a PCA9685: one for all its outputs, in steps of its oscillator."""

from typing import Final

from firmware_runtime.errors import SettingError

COUNTS: Final = 4096
"""Of a PWM cycle."""
NOMINAL_OSC_HZ: Final = 25e6


def prescale_for(frequency_hz: float, osc_hz: float = NOMINAL_OSC_HZ) -> int:
    """Give the PRE_SCALE value whose PWM frequency is nearest; refuse what the chip cannot do.

    Data sheet 7.3.5: round(osc / (4096 f)) - 1, from 3 to 255, so 24 Hz to 1526 Hz.
    """
    if not 20e6 <= osc_hz <= 30e6:
        raise SettingError(
            f"osc_hz is {osc_hz}", where="PCA9685 oscillator", expected="20e6 to 30e6"
        )
    if not 24 <= frequency_hz <= 1526:
        raise SettingError(
            f"{frequency_hz} Hz", where="PCA9685 frequency", expected="24 to 1526 Hz"
        )
    prescale = round(osc_hz / (COUNTS * frequency_hz)) - 1
    if not 3 <= prescale <= 255:
        slowest, fastest = actual_frequency_hz(255, osc_hz), actual_frequency_hz(3, osc_hz)
        raise SettingError(
            f"{frequency_hz} Hz",
            where="PCA9685 frequency",
            expected=f"{slowest:.1f} to {fastest:.1f} Hz from an oscillator of {osc_hz:.0f} Hz",
        )
    return prescale


def actual_frequency_hz(prescale: int, osc_hz: float = NOMINAL_OSC_HZ) -> float:
    """PWM frequency that a PRE_SCALE value gives."""
    return osc_hz / (COUNTS * (prescale + 1))
