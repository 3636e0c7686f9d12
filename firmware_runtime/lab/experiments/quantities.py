"""Names of numbers in words: `local_delay_p99_ms` is `local delay p99`, its value `0.4 ms`."""

from typing import Final

from firmware_runtime.statistics.number_formats import NOTHING

_UNITS: Final = {
    "kg_m2": "kg m2",
    "n_per_s": "N/s",
    "rad_s2": "rad/s2",
    "rad_s": "rad/s",
    "deg_s": "deg/s",
    "m_s2": "m/s2",
    "m_s": "m/s",
    "percent": "%",
    "rad": "rad",
    "deg": "deg",
    "nms": "N m s",
    "nm": "N m",
    "n": "N",
    "kg": "kg",
    "hz": "Hz",
    "db": "dB",
    "mm": "mm",
    "m": "m",
    "us": "us",
    "ms": "ms",
    "s": "s",
}
"""By the end of a name; a longer end goes before one that it contains."""


def in_words(name: str) -> str:
    """A name without its unit, with spaces."""
    end = _end(name)
    return (name.removesuffix(f"_{end}") if end else name).replace("_", " ")


def with_unit(name: str, value: float) -> str:
    """A value of that name, to four figures, with its unit."""
    is_whole = value == round(value) and abs(value) >= 10
    number = f"{value:,.0f}" if is_whole else f"{value:.4g}"
    return f"{number} {_UNITS[end]}" if (end := _end(name)) else number


def milliseconds(span_ms: float | None) -> str:
    """A span for a table, a dash where there is none."""
    return NOTHING if span_ms is None else f"{span_ms:.3f} ms"


def _end(name: str) -> str:
    return next((end for end in _UNITS if name.endswith(f"_{end}")), "")
