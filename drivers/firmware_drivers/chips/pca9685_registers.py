"""Registers of a PCA9685: its rate, and four bytes a channel, one burst for neighbours.

A channel has an on count and an off count of 12 bits within the cycle, and with each a bit that is
always on, or always off; off wins (data sheet rev. 4, 7.3.3).
"""

import struct
from typing import Final

from firmware_runtime.errors import SettingError
from firmware_runtime.hal.i2c import Message

COUNTS: Final = 4096
"""Counts of a PWM cycle."""
NOMINAL_OSC_HZ: Final = 25e6
CHANNELS: Final = 16
LED0_ON_L: Final = 0x06
FULL: Final = 0x10
"""Bit 4 of an ON_H or OFF_H register: always on, or always off."""

FULL_ON: Final = FULL << 8
FULL_OFF: Final = FULL << 24
"""All four registers of a channel as one number, off counts above on counts."""
BURSTS: Final = tuple(struct.Struct(f"<B{channels}I") for channels in range(CHANNELS + 1))


def duty_burst(channels: int) -> tuple[Message, ...]:
    """Transaction that sets the duties of so many channels, for the bus-time budget."""
    return (bytes(BURSTS[channels].size),)


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


def actual_cycle_us(frequency_hz: float, osc_hz: float = NOMINAL_OSC_HZ) -> float:
    """Length of a PWM cycle at the rate that is nearest: at 490 Hz that is 508.6, 74 us less.

    A pulse has to fit into it. Raises SettingError for a rate that the chip cannot have.
    """
    return 1e6 / actual_frequency_hz(prescale_for(frequency_hz, osc_hz), osc_hz)
