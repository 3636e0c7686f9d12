"""The space of a campaign: every single fault at every use of the lines of a mission.

A fault of a device strikes with a transaction of that device: one that is made between two of them
strikes the second one, and is the same run. So the space has each fault once for each use in which
it shows: what alters readings at those that read, what refuses a written byte at those that write.
Kinds that hold up a whole bus are tried on the bus, too; a push at each use of the first line.
"""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Final

from msgspec import Struct

from firmware_runtime.devs.time import SECOND
from firmware_runtime.hal.strike import KINDS, Kind, Place, Strike
from firmware_runtime.lab.campaign.healthy import Healthy, UseOfLine, healthy
from firmware_runtime.lab.campaign.mission import Mission

FOR_A_WHILE_S: Final = 1.0
OF_LINES: Final = ("stuck", "arbitration", "fault", "slow")
"""Kinds that strike all of a bus."""
_BITS: Final = 64
_GOLDEN: Final = 0x9E3779B97F4A7C15
"""The golden section of 2 to the power of 64, which is odd."""


class Case(Struct, frozen=True):
    """One fault of the space, and the last look before the step in which it strikes."""

    strike: Strike
    before: int


@lru_cache(maxsize=4)
def space_of(mission: Mission) -> tuple[Case, ...]:
    """All of them, in order of time. Raises ConfigError for a mission that is not sound."""
    found = healthy(mission)
    return tuple(case for use in found.uses for case in _at_use(found, use))


def spread(size: int) -> Iterator[int]:
    """Numbers below a size, each once, such that the first so many are spread evenly.

    They are the multiples of the golden section within a circle, whose gaps are of two sizes that
    are alike, or three; those met before are left out.
    """
    seen = bytearray(size)
    at, left = 0, size
    while left:
        number = at * size >> _BITS
        at = (at + _GOLDEN) % (1 << _BITS)
        if not seen[number]:
            seen[number] = 1
            left -= 1
            yield number


def _at_use(found: Healthy, use: UseOfLine) -> Iterator[Case]:
    first_line = found.uses[0].line
    for place in found.places:
        for kind in _kinds_at(place, use):
            yield from _cases(kind, place.name, use)
    if use.line == first_line and any(each.name == "push" for each in found.kinds):
        yield from _cases(KINDS["push"], "", use)


def _kinds_at(place: Place, use: UseOfLine) -> Sequence[Kind]:
    """Kinds that show at a place in this use of its line."""
    if place.line != use.line:
        return ()
    kinds = [KINDS[name] for name in place.kinds]
    if place.is_line:
        return [kind for kind in kinds if kind.name in OF_LINES]
    if place.address != use.use.address:
        return ()
    return [kind for kind in kinds if use.use.shows(kind)]


def _cases(kind: Kind, device: str, use: UseOfLine) -> Iterator[Case]:
    for for_s in spans_of(kind):
        yield Case(Strike(kind.name, device, use.use.at / SECOND, for_s), use.before)


def spans_of(kind: Kind) -> tuple[float | None, ...]:
    """How long a fault of a kind lasts: once, for a while, for ever, as far as it can."""
    if kind.is_moment:
        return (None,)
    return (0.0, FOR_A_WHILE_S, None) if kind.of == "I2C" else (FOR_A_WHILE_S, None)
