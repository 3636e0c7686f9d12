"""How often the truth lies in the 95 % intervals of `identify`, over random plants.

    python -m benchmarks.identification [--plants N] [--measures rate|position] [--json]

Each seed is a plant, an input, noise and a recording of 24 s. Prints, by parameter, how often the
truth was in the interval, the estimates' bias and spread in percent, and the spread over what the
interval takes it to be; how many fits went astray and of how many the fit itself warned; last, the
share of all. Bias and spread are of the middle (median, and median distance from it times 1.4826),
so that a stray fit does not hide what the others are like; one whose inertia is off by a tenth or
more is counted as astray.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from benchmarks.identification.plants import LAG_S, drawn
from benchmarks.shared.seeds import add_seed_options, by_seed
from firmware_runtime.identification.identified import identify
from firmware_runtime.identification.plant import KEYS, Numbers
from firmware_runtime.identification.series import Quantity

_ASTRAY: Final = 0.1


@dataclass(frozen=True, slots=True)
class Judged:
    """One fit beside the truth."""

    row: Sequence[tuple[bool, float, float]]
    """By parameter: whether the interval holds the truth, the relative error, error over half."""
    warned: bool
    """Whether the fit says of itself that it may be astray."""


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.identification", description=__doc__)
    add_seed_options(parser, plants=200)
    parser.add_argument("--measures", choices=("rate", "position"), default="rate")
    chosen = parser.parse_args()
    report = summary(by_seed(partial(judged, quantity=chosen.measures), chosen))
    print(json.dumps(report) if chosen.json else text(report))
    return 0


def judged(seed: int, quantity: Quantity) -> Judged:
    """One plant, identified, beside the truth."""
    case = drawn(seed, quantity)
    identified, found = identify(case.series, "rotation", LAG_S)
    row = []
    for truth, each in zip(case.plant.values, identified.parameters.values(), strict=True):
        high = np.inf if each.high is None else each.high
        half = 0.5 * (high - (each.low or 0.0))
        row.append((bool(each.holds(truth)), each.value / truth - 1.0, (each.value - truth) / half))
    return Judged(row, found.wanders or not found.settled)


def summary(cases: Sequence[Judged]) -> dict[str, object]:
    """The figures, by parameter and of all."""
    table = np.array([each.row for each in cases], dtype=float)
    holds, errors, halves = table[:, :, 0], table[:, :, 1], table[:, :, 2]
    parameters = {
        key: {
            "coverage": float(holds[:, place].mean()),
            "bias_percent": float(100 * np.median(errors[:, place])),
            "spread_percent": 100 * _spread(errors[:, place]),
            "spread_over_stated": 1.96 * _spread(halves[:, place]),
        }
        for place, key in enumerate(KEYS["rotation"])
    }
    astray = np.abs(errors[:, 0]) > _ASTRAY
    return {
        "plants": len(cases),
        "parameters": parameters,
        "astray": int(astray.sum()),
        "warned": sum(each.warned for each in cases),
        "coverage_of_the_others": float(holds[~astray].mean()),
        "coverage": float(holds.mean()),
    }


def _spread(values: Numbers) -> float:
    """The standard deviation, by the median distance from the median."""
    return float(1.4826 * np.median(np.abs(values - np.median(values))))


def text(report: dict[str, object]) -> str:
    """The same for people, the share last."""
    parameters = report["parameters"]
    assert isinstance(parameters, dict)  # noqa: S101 -- as `summary` makes it
    lines = [f"{'':22}{'covered':>9}{'bias':>10}{'spread':>10}{'over stated':>13}"]
    lines += [
        f"{key:22}{each['coverage']:>9.1%}{each['bias_percent']:>9.2f}%"
        f"{each['spread_percent']:>9.2f}%{each['spread_over_stated']:>13.2f}"
        for key, each in parameters.items()
    ]
    others = f"{report['coverage_of_the_others']:.1%}"
    lines.append(
        f"{report['astray']} fits astray, {report['warned']} warned of; the truth in the intervals "
        f"of those not astray: {others}"
    )
    covered = f"{report['coverage']:.1%}"
    lines.append(f"{report['plants']} plants, the truth in the 95 % interval: {covered}")
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
