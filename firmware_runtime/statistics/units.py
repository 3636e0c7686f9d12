"""Units of numbers by their names: that of `pair_thrust_n` is N."""

from typing import Final

_UNITS: Final = {
    "kg_m2": "kg m2",
    "n_per_s": "N/s",
    "per_s": "1/s",
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


def unit_of(name: str) -> str:
    """The unit that a name ends in, as it is written; empty if it says none."""
    end = end_of_unit(name)
    return _UNITS[end] if end else ""


def end_of_unit(name: str) -> str:
    """The end of a name that is its unit, such as `rad_s`; empty if there is none."""
    return next((end for end in _UNITS if name.endswith(f"_{end}")), "")
