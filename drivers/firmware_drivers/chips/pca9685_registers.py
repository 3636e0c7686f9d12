"""Rate and duties as the registers of a PCA9685: four bytes a channel, one burst for neighbours.

A channel has an on count and an off count of 12 bits within the cycle, and with each a bit that is
always on, or always off; off wins (data sheet rev. 4, 7.3.3).
"""

import math
import struct
from collections.abc import Iterable, Sequence
from itertools import count
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

_FULL_ON: Final = FULL << 8
_FULL_OFF: Final = FULL << 24
"""All four registers of a channel as one number, off counts above on counts."""
_BURSTS: Final = tuple(struct.Struct(f"<B{channels}I") for channels in range(CHANNELS + 1))


def duty_burst(channels: int) -> tuple[Message, ...]:
    """Transaction that sets the duties of so many channels, for the bus-time budget."""
    return (bytes(_BURSTS[channels].size),)


def burst_of(
    first_channel: int, duties: Sequence[float], on_step: int = 0
) -> tuple[bytes, tuple[float, ...]]:
    """Give the bytes that set neighbouring channels, and the duties that they make, in 4096ths.

    0 is full-off and 1 full-on, without a pulse. Channel n is switched on at count n `on_step`.
    Raises ValueError for a duty outside 0 to 1 or a channel that is not there.
    """
    if not 0 <= first_channel < first_channel + len(duties) <= CHANNELS:
        raise ValueError(
            f"{len(duties)} duties from channel {first_channel}, expected them within 0 to "
            f"{CHANNELS - 1}"
        )
    words: list[int] = []
    made: list[float] = []
    known: dict[float, tuple[int, float]] = {}
    for duty in duties:
        if duty not in known:  # each once: pairs are often driven alike
            known[duty] = _registers_of(duty)
        word, share = known[duty]
        words.append(word)
        made.append(share)
    if on_step:
        words = _staggered(words, first_channel * on_step, on_step)
    return _BURSTS[len(words)].pack(LED0_ON_L + 4 * first_channel, *words), tuple(made)


def _registers_of(duty: float) -> tuple[int, float]:
    """The registers of a channel that is switched on at count 0, and the duty they make."""
    if not 0.0 <= duty <= 1.0:
        raise ValueError(f"a duty of {duty}, expected 0 to 1")
    counts = math.floor(duty * COUNTS + 0.5)
    if 0 < counts < COUNTS:
        return counts << 16, counts / COUNTS
    return (_FULL_ON, 1.0) if counts else (_FULL_OFF, 0.0)


def _staggered(words: Iterable[int], first_on: int, step: int) -> list[int]:
    """The registers of neighbouring channels that are switched on one `step` after the other."""
    return [
        word if word in {_FULL_ON, _FULL_OFF} else ((word >> 16) + on) % COUNTS << 16 | on
        for on, word in zip(count(first_on, step), words)
    ]


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
