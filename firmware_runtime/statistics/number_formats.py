"""How numbers are written for people: spans of time, shares, rates, counts.

What is not known is a dash. A terminal has plain letters (`46.1 us`, `-`, `13.0%`), the page has
typeset ones (`46.1 µs`, en dash, `13.0 %`).
"""

from typing import Any, Final

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
    """How long something went on: `20.00 s`, `72 h 5 min`."""
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
    """How often a model is due; one without a period has events."""
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
