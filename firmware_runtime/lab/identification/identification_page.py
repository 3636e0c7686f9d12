"""Numbers that were identified, for people: lines for a terminal, and a page."""

from collections.abc import Iterator, Mapping
from typing import Final

from firmware_runtime.lab.identification.fit import Fit
from firmware_runtime.lab.identification.identified import CONFIDENCE, Identified
from firmware_runtime.lab.identification.recorded_series import Series
from firmware_runtime.statistics.run_text import aligned
from firmware_runtime.view import parts
from firmware_runtime.view.parts import Bullets, Page, curve, section, table

UNITS: Final[Mapping[str, tuple[str, str]]] = {
    "inertia_kg_m2": ("moment of inertia", "kg m2"),
    "damping_nms": ("viscous damping", "N m s"),
    "coulomb_friction_nm": ("Coulomb friction", "N m"),
    "static_friction_nm": ("static friction", "N m"),
    "mass_kg": ("mass", "kg"),
    "damping_ns_m": ("viscous damping", "N s/m"),
    "coulomb_friction_n": ("Coulomb friction", "N"),
    "static_friction_n": ("static friction", "N"),
    "delay_s": ("delay", "s"),
}
_OUTPUT: Final = {
    ("rotation", "rate"): "rad/s",
    ("rotation", "position"): "rad",
    ("translation", "rate"): "m/s",
    ("translation", "position"): "m",
}
_HEAD: Final = ("", "value", f"{CONFIDENCE:.0%} from", "to", "unit", "by regression")


def lines(identified: Identified) -> Iterator[str]:
    """A table of the numbers, then what is to be known beside them."""
    yield from aligned([_HEAD, *_rows(identified)])
    yield from sentences(identified)


def sentences(identified: Identified) -> Iterator[str]:
    """Yield sentences that belong beside the numbers."""
    order = len(identified.noise_weights)
    yield (
        f"{identified.measurements} measurements in {identified.seconds:.3g} s; the plant explains "
        f"{identified.explained:.2%} of their variance"
    )
    kind = f"foretold by the {order} before it" if order else "white"
    yield f"noise {identified.noise:.3g}, {kind}; actuators' lag {identified.lag_s:g} s, as stated"
    for warning in identified.warnings:
        yield f"warning: {warning}"


def page(board: str, title: str, identified: Identified, series: Series, fit: Fit) -> Page:
    """Numbers, and the measured output beside the simulated one."""
    return Page(
        title=f"{board}: {title}, identified",
        opening=[Bullets(items=list(sentences(identified)))],
        parts=[
            section("Numbers", table("The plant", _HEAD, _rows(identified))),
            section("Measured and simulated", *plots(identified, series, fit)),
        ],
    )


def plots(identified: Identified, series: Series, fit: Fit) -> tuple[parts.Series, ...]:
    """The input; the output as measured and as simulated from the input alone; the difference."""
    unit = _OUTPUT[identified.structure, series.quantity]
    at = series.at.tolist()
    measured, residuals = series.measured.tolist(), fit.residuals.tolist()
    simulated = (series.measured - fit.residuals).tolist()
    output = [
        curve("measured", list(zip(at, measured, strict=True))),
        curve("simulated", list(zip(at, simulated, strict=True))),
    ]
    given = list(zip(series.given_at.tolist(), series.given.tolist(), strict=True))
    pushed = "N m" if identified.structure == "rotation" else "N"
    difference = curve("difference", list(zip(at, residuals, strict=True)))
    return (
        parts.Series("Input", "s", pushed, [curve("input", given)]),
        parts.Series("Output, measured and simulated", "s", unit, output),
        parts.Series("Difference", "s", unit, [difference]),
    )


def _rows(identified: Identified) -> list[tuple[str, ...]]:
    rows = []
    for key, each in identified.parameters.items():
        name, unit = UNITS[key]
        ends = ["unknown" if end is None else f"{end:.4g}" for end in (each.low, each.high)]
        rows.append((name, f"{each.value:.4g}", *ends, unit, f"{each.regression:.3g}"))
    return rows
