"""What a step of the position estimator costs, by how old the positions are that come with it.

    python -m benchmarks.estimator [--steps N] [--json]

The estimator alone, one inertial sample a step; CPU time of `external`, `output` and `internal`. A
position as old as the whole history is the dearest that is taken; two of them a step are the bound.
"""

import argparse
import json
from statistics import quantiles
from time import thread_time_ns

from benchmarks.shared.conditions import conditions, conditions_text
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.models.position_estimator import EstimatorSettings, PositionEstimator
from firmware_runtime.models.position_filter import FilterNoise
from firmware_runtime.models.position_fix import PlanarInertial, PositionFix

TICK = 10 * MILLISECOND
HISTORY = 50
NOISE = FilterNoise(0.005, 0.01, 0.01, 0.001, 0.001, 0.2, 0.1)
CASES: dict[str, tuple[float, ...]] = {
    "no position": (),
    "one, 0.05 s old": (0.05,),
    "one, 0.2 s old": (0.2,),
    "two, as old as the history (0.5 s)": (0.49, 0.485),
}
"""Ages of the positions that come with a step, s."""


def measure(ages_s: tuple[float, ...], steps: int) -> list[float]:
    """CPU time of each step, us."""
    model = PositionEstimator("estimator", EstimatorSettings(NOISE, 25.0, HISTORY, 0))
    model.initialize()
    found: list[float] = []
    for n in range(steps + 2 * HISTORY):
        ages = ages_s if n > HISTORY else (0.0,)
        model.position.extend(PositionFix(1.0, 2.0, age_s) for age_s in ages)
        model.inertial.append(PlanarInertial(0.01, -0.02, 0.01 * n, 1.0))
        begin = thread_time_ns()
        model.external(TICK)
        model.output()
        model.internal()
        if n >= 2 * HISTORY:
            found.append((thread_time_ns() - begin) / 1e3)
        model.position.clear()
        model.inertial.clear()
    return found


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.estimator", description=__doc__)
    parser.add_argument("--steps", type=int, default=3000)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    arguments = parser.parse_args()
    report: dict[str, dict[str, float]] = {}
    for name, ages_s in CASES.items():
        times = quantiles(measure(ages_s, arguments.steps), n=100)
        report[name] = {"p50_us": times[49], "p99_us": times[98]}
    if arguments.json:
        print(json.dumps({"cases": report, "conditions": conditions()}))
        return 0
    print(f"{'positions with a step':38}{'p50':>9}{'p99':>9}  us of CPU")
    for name, figures in report.items():
        print(f"{name:38}{figures['p50_us']:9.1f}{figures['p99_us']:9.1f}")
    print(conditions_text(conditions()))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
