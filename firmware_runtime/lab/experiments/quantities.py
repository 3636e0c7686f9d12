"""Names of numbers in words: `local_delay_p99_ms` is `local delay p99`, its value `0.4 ms`."""

from firmware_runtime.statistics.number_formats import NOTHING
from firmware_runtime.statistics.units import end_of_unit, unit_of


def in_words(name: str) -> str:
    """A name without its unit, with spaces."""
    end = end_of_unit(name)
    return (name.removesuffix(f"_{end}") if end else name).replace("_", " ")


def with_unit(name: str, value: float) -> str:
    """A value of that name, to four figures, with its unit."""
    is_whole = value == round(value) and abs(value) >= 10
    number = f"{value:,.0f}" if is_whole else f"{value:.4g}"
    return f"{number} {unit}" if (unit := unit_of(name)) else number


def milliseconds(span_ms: float | None) -> str:
    """A span for a table, a dash where there is none."""
    return NOTHING if span_ms is None else f"{span_ms:.3f} ms"
