"""Formats of numbers and dates for people: spans of time, shares, rates, counts, when a run was.

What is not known is a dash. A terminal has plain letters (`46.1 us`, `-`, `13.0%`), the page has
typeset ones (`46.1 µs`, en dash, `13.0 %`).

Dates follow from pairs of an instant of the run and of the system's time. A run's instants are
those of a clock that nothing sets. The system's may be set, so a run notes it at its start and, in
real time, again and again: what is between two pairs follows from the first.
"""

from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from typing import Any, Final

from firmware_runtime.devs.time import MILLISECOND, SECOND

NOTHING: Final = "\N{EN DASH}"
"""What is not known, on the page."""
NOT_KNOWN: Final = "-"
"""The same in a terminal."""
_MICRO: Final = "\N{MICRO SIGN}s"
_UNITS: Final = ((1_000_000_000, "s"), (1_000_000, "ms"), (1_000, _MICRO), (1, "ns"))
_DECIMALS: Final = {"s": 2, "ms": 2, _MICRO: 1, "ns": 0}
_IN_TERMINAL: Final = ((1e6, "s"), (1e3, "ms"))
_IN_COLUMN: Final = (("us", 1.0), ("ms", 1e3), ("s", 1e6))
_TENS: Final = 10.0


def duration(ns: float | None) -> str:
    """A measured span: `46.1 µs`, `2.10 ms`."""
    if ns is None:
        return NOTHING
    for size, unit in _UNITS:
        if ns >= size:
            return f"{ns / size:.{_DECIMALS[unit]}f} {unit}"
    return "0 s" if ns == 0 else f"{ns:.1f} ns"


def microseconds(us: float | None) -> str:
    """A measured span in a terminal: `46.1 us`, `2.10 ms`."""
    if us is None:
        return NOT_KNOWN
    for size, unit in _IN_TERMINAL:
        if us >= size:
            return f"{us / size:.2f} {unit}"
    return f"{us:.1f} us"


def milliseconds(us: float | None) -> str:
    """A span to two digits, such as `0.18 ms`."""
    if us is None:
        return NOT_KNOWN
    value = us / 1000
    return f"{value:.2g} ms" if value < _TENS else f"{value:.0f} ms"


def three_digits(us: float | None) -> str:
    """A span for a narrow column: `46.1 us`, `2.1 ms`."""
    if us is None:
        return NOT_KNOWN
    unit, size = next((each for each in _IN_COLUMN if us < 999.5 * each[1]), _IN_COLUMN[-1])
    return f"{us / size:.3g} {unit}"


def percent(part: float | None) -> str:
    """A share in a terminal."""
    return NOT_KNOWN if part is None else f"{part:.1%}"


def duration_us(us: float | None) -> str:
    """The same, of a number in microseconds."""
    return duration(None if us is None else us * 1000)


def round_duration(ns: int) -> str:
    """A span that was chosen, not measured: `10 ms`."""
    size, unit = next(((size, unit) for size, unit in _UNITS if ns >= size), (1, "s"))
    return f"{ns / size:g} {unit}"


def passed(ns: int) -> str:
    """Return how long something went on: `20.00 s`, `72 h 5 min`."""
    minutes = ns // 60_000_000_000
    if minutes < 2:
        return duration(ns)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60:,} h {minutes % 60} min"


def instant(t_ns: int | None) -> str:
    """A moment of the run, in seconds since its start."""
    return instant_s(None if t_ns is None else t_ns / 1e9)


def instant_s(at_s: float | None) -> str:
    """The same, of a number in seconds."""
    return NOTHING if at_s is None else f"{at_s:.3f} s"


def seconds(at_s: float) -> str:
    """A moment of the run, or its length, in a terminal: `12.34 s`."""
    return f"{at_s:.2f} s"


def share(part: float | None) -> str:
    """A share in percent; what is not nothing never reads as nothing."""
    if part is None:
        return NOTHING
    if part in {0, 1}:
        return f"{part * 100:.0f} %"
    if part < 0.0001:
        return "under 0.01 %"
    return f"{part * 100:.{2 if part < 0.01 else 1}f} %"


def rate(period_us: float | None) -> str:
    """Return how often a model is due; one without a period has events."""
    return "events" if period_us is None else hertz(1e6 / period_us)


def hertz(rate_hz: float) -> str:
    """A rate in four digits."""
    return f"{rate_hz:.4g} Hz"


def count(number: int, noun: str = "", plural: str = "") -> str:
    """A number with its thousands set apart, and what it counts."""
    word = noun if number == 1 else plural or f"{noun}s"
    return f"{number:,} {word}" if noun else f"{number:,}"


def plain(value: Any) -> str:  # noqa: ANN401 -- whatever a file's conditions hold
    """A value of the conditions."""
    if value is None:
        return "not shown"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, dict):
        return ", ".join(f"{name} {plain(each)}" for name, each in value.items()) or "none"
    if isinstance(value, list):
        return ", ".join(map(plain, value)) or "none"
    return str(value)


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
    """Return what `utc` said, for people."""
    whole, nanoseconds = said.removesuffix("Z").split(".")
    date = datetime.fromisoformat(f"{whole}+00:00")
    return local(round(date.timestamp()) * SECOND + int(nanoseconds))


def as_json(pairs: Sequence[Pair]) -> list[dict[str, object]]:
    """Pairs as JSON has them."""
    return [{"t_ns": at, "date": utc(date)} for at, date in pairs]
