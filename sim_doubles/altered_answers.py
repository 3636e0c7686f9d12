"""Faults of what is read, by kind: late, one bit, one byte, one measured word of a chip."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

from firmware_runtime.hal.i2c import Message
from sim_doubles.altered_readings import LESS, OFFSET, AlteredReadings
from sim_doubles.faults import AlteredAnswer
from sim_doubles.i2c_target import Target, Words
from sim_doubles.scripted_fault import Reading, burst_start

FULL_SCALE: Final = "full-scale"
SWAP: Final = "swap"
"""The kind that exchanges a word with its neighbour, where it has one."""
NEGATE: Final = "negate"
"""The kind that gives a word the other sign, where it has one."""
_SIGNED, _UNSIGNED = (-(1 << 15), (1 << 15) - 1), (0, (1 << 16) - 1)


@dataclass(frozen=True, kw_only=True, eq=False)
class LateAnswer(AlteredAnswer):
    """What is read is what the chip put on the bus one transaction of these messages ago."""

    _before: dict[tuple[int, tuple[Message, ...]], bytes] = field(default_factory=dict, init=False)

    def alter(self, reading: Reading) -> bytes:
        """Return the answer before; this one, where there was none."""
        before = self._before.get(reading.asked) or reading.before or reading.answer
        self._before[reading.asked] = reading.answer
        return before


@dataclass(frozen=True, kw_only=True, eq=False)
class InvertedBits(AlteredAnswer):
    """Bits of what is read arrive inverted: those of `mask` in one byte, counted round."""

    number: int
    """Of the bit if the mask is none, else of the byte."""
    mask: int | None = None

    def alter(self, reading: Reading) -> bytes:
        """Return the answer with these bits inverted."""
        answer = reading.answer
        if not answer:
            return answer
        byte, bit = divmod(self.number, 8) if self.mask is None else (self.number, 0)
        altered = bytearray(answer)
        altered[byte % len(answer)] ^= 0x80 >> bit if self.mask is None else self.mask
        return bytes(altered)


def can_be_altered(words: Words, kind: str) -> bool:
    """Return whether a fault of this kind alters these words: one needs a neighbour, one a sign."""
    return (kind != SWAP or words.length > 1) and (kind != NEGATE or words.is_signed)


@dataclass(frozen=True, kw_only=True, eq=False)
class AlteredWord(AlteredAnswer):
    """One measured word of a chip is read as another: `number` counts round through them.

    In each second round an offset of what has a sign is the other way.

    Where inputs take turns in it, that of one is: of the one that is read first.
    """

    kind: str
    target: Target
    number: int
    _source: list[int] = field(default_factory=list, init=False)
    """The one input that is broken, once it was read."""

    def fits(self, messages: Sequence[Message]) -> bool:
        """Return whether the word is among what is read."""
        if not super().fits(messages) or not can_be_altered(self._group, self.kind):
            return False
        begin = self._register - burst_start(messages)
        return begin >= 0 and begin + 2 <= sum(m for m in messages if isinstance(m, int))

    def alter(self, reading: Reading) -> bytes:
        """Return the answer with that word in it."""
        answer, begin = reading.answer, self._register - burst_start(reading.messages)
        source = self.target.source
        if source is not None:
            if not self._source:
                self._source.append(source)
            if source not in self._source:
                return answer
        if self.kind == SWAP:
            return self._swapped(answer, begin)
        if not self._readings.is_broken:
            if reading.before is not None and source is None:
                self._readings.altered(self._word(reading.before, begin))
            self._readings.break_(self._kind, once=False)
        word = self._readings.altered(self._word(answer, begin))
        altered = word.to_bytes(2, self._group.order, signed=self._group.is_signed)
        answer = answer[:begin] + altered + answer[begin + 2 :]
        return self._overflown(answer, reading) if self.kind == FULL_SCALE else answer

    def _overflown(self, answer: bytes, reading: Reading) -> bytes:
        """Let the chip say so of a word at the end of its scale, where it does and that is read."""
        register, bit = self._group.overflow or (-1, 0)
        place = register - burst_start(reading.messages)
        if not 0 <= place < len(answer):
            return answer
        return answer[:place] + bytes([answer[place] | bit]) + answer[place + 1 :]

    def _swapped(self, answer: bytes, begin: int) -> bytes:
        """Exchange the word with the next one of its group; the last one with the first."""
        group, index = self._place
        other = begin + 2 if index + 1 < group.length else begin - 2 * index
        if not 0 <= other <= len(answer) - 2:
            return answer
        altered = bytearray(answer)
        altered[begin : begin + 2] = answer[other : other + 2]
        altered[other : other + 2] = answer[begin : begin + 2]
        return bytes(altered)

    def _word(self, answer: bytes, begin: int) -> int:
        group, word = self._group, answer[begin : begin + 2]
        return int.from_bytes(word, group.order, signed=group.is_signed)

    @cached_property
    def _readings(self) -> AlteredReadings:
        return AlteredReadings(*(_SIGNED if self._group.is_signed else _UNSIGNED))

    @property
    def _kind(self) -> str:
        """Its kind; an offset of what has a sign is the other way in each second round."""
        is_other_way = self._group.is_signed and self.number // self._count % 2 == 1
        return LESS if self.kind == OFFSET and is_other_way else self.kind

    @property
    def _count(self) -> int:
        return sum(each.length for each in self.target.measured)

    @property
    def _place(self) -> tuple[Words, int]:
        words = self.target.measured
        left = self.number % self._count
        for each in words:
            if left < each.length:
                return each, left
            left -= each.length
        raise AssertionError(words)

    @property
    def _group(self) -> Words:
        return self._place[0]

    @property
    def _register(self) -> int:
        group, index = self._place
        return group.register + 2 * index
