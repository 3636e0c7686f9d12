"""Duties as the registers of a PCA9685's outputs: four bytes a channel, one burst for neighbours.

A channel has an on count and an off count of 12 bits within the cycle, and with each a bit that is
always on, or always off; off wins (data sheet rev. 4, 7.3.3).
"""

import math
import struct
from collections.abc import Iterable, Sequence
from itertools import count
from typing import Final

from firmware_drivers.chips.pca9685_rate import COUNTS
from firmware_runtime.hal.i2c import Message

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
