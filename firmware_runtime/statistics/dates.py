"""When a run was, by the calendar: pairs of an instant of the run and of the system's time.

A run's instants are those of a clock that nothing sets. The system's may be set, so a run notes it
at its start and, in real time, again and again: what is between two pairs follows from the first.
"""

from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, SECOND

Pair = tuple[int, int]
"""An instant of the run, and the system's time then, ns since 1970."""

STEP: Final = 5 * MILLISECOND
"""Ns by which two pairs differ if the system's clock was set between them, at least."""
_LATEST: Final = (1 << 62) - 1


class Dates:
    """The dates of a run whose clock goes `speed` times as fast as time, 0: virtual."""

    def __init__(self, began: int | None, noted: Iterable[Pair], speed: float) -> None:
        self._speed = speed or 1.0
        self.pairs: list[Pair] = []
        """Of the start, and of each time that the system's clock was set."""
        pairs = sorted(each for each in noted if 0 <= each[0] <= _LATEST >= each[1] >= 0)
        if not pairs and began is not None and 0 < began < _LATEST:
            pairs = [(0, began)]
        for at, date in pairs:
            if not self.pairs:
                self.pairs.append((0, date - round(at / self._speed)))
            elif abs(date - self._of(at)) > STEP:
                self.pairs.append((at, date))

    def of(self, at: int) -> int | None:
        """The date of an instant, ns since 1970; None where it is not known."""
        return self._of(at) if self.pairs else None

    def _of(self, at: int) -> int:
        since, date = self.pairs[0]
        for each in self.pairs[1:]:
            if each[0] > at:
                break
            since, date = each
        return max(0, date + round((at - since) / self._speed))

    def said(self, at: int) -> str:
        """The date of an instant in brackets, to follow it; empty where it is not known."""
        date = self.of(at)
        return "" if date is None else f" ({local(date)})"

    def as_json(self, at: int) -> dict[str, str]:
        """The date of an instant in UTC, as an entry of an object; none where it is not known."""
        date = self.of(at)
        return {} if date is None else {"date": utc(date)}


NO_DATES: Final = Dates(None, (), 1.0)


def utc(date: int) -> str:
    """A date for programs: ISO 8601, to the nanosecond."""
    whole = datetime.fromtimestamp(date // SECOND, UTC)
    return f"{whole:%Y-%m-%dT%H:%M:%S}.{date % SECOND:09d}Z"


def local(date: int) -> str:
    """A date for people: local time, to the millisecond, with its offset."""
    here = datetime.fromtimestamp(date // SECOND, UTC).astimezone()
    return f"{here:%Y-%m-%d %H:%M:%S}.{date % SECOND // MILLISECOND:03d}{here:%z}"


def local_of(said: str) -> str:
    """What `utc` said, for people."""
    whole, nanoseconds = said.removesuffix("Z").split(".")
    date = datetime.fromisoformat(f"{whole}+00:00")
    return local(round(date.timestamp()) * SECOND + int(nanoseconds))


def as_json(pairs: Sequence[Pair]) -> list[dict[str, object]]:
    """Pairs as JSON has them."""
    return [{"t_ns": at, "date": utc(date)} for at, date in pairs]
