"""What accounting adds to a step: the same steps taken three ways that take turns.

The steps run in a row, without a sleep; `accounting.cold` has them as a robot's loop finds them.
"""

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.accounting.steps import WAYS

COUNTS = (1, 4, 16)
GOAL_US = 2.0


def measure(directory: Path, repetitions: int, activations: int) -> dict[str, Any]:
    """Every way with every number of models, in turns."""
    found = [_measure(directory, count, repetitions, -(-activations // count)) for count in COUNTS]
    return {
        "steps_of": found,
        **step_and_activation(found[0], found[-1]),
        "goal_us": GOAL_US,
        "ratio": max(each["ratio"] for each in found),
    }


def text(result: dict[str, Any]) -> list[str]:
    """The result for people."""
    lines = [
        "Microseconds a step, medians (least), all models due at once:",
        f"  {'models':>6}{'bare':>14}{'accounted':>16}{'whole loop':>16}",
    ]
    for each in result["steps_of"]:
        cells = (f"{each['us'][way]:.2f} ({each['least_us'][way]:.2f})" for way in WAYS)
        lines.append(f"  {each['models']:6}" + "".join(f"{cell:>16}" for cell in cells)[2:])
    lines.append("Microseconds that accounting adds, medians of the rounds' differences:")
    lines.append(f"  {'models':>6}{'a step':>14}{'an activation':>16}")
    lines += [
        f"  {each['models']:6}{each['accounting_us'] * each['models']:14.2f}"
        f"{each['accounting_us']:16.2f}"
        for each in result["steps_of"]
    ]
    lines += [
        f"  that is {result['step_us']:.2f} a step and {result['activation_us']:.2f} an activation",
        f"  goal on a PC: {result['goal_us']:g} us or less an activation",
    ]
    lines += [
        f"ratio {each['ratio']:.1f} (accounted step by bare step, {each['models']} models)"
        for each in result["steps_of"]
    ]
    return [*lines, f"ratio {result['ratio']:.1f} (the greatest)"]


def _measure(directory: Path, count: int, repetitions: int, steps: int) -> dict[str, Any]:
    rounds = [
        {way: step(count, steps, directory) for way, step in WAYS.items()}
        for _ in range(repetitions)
    ]
    return summary(count, rounds)


def summary(count: int, rounds: Sequence[dict[str, float]]) -> dict[str, Any]:
    """What rounds of microseconds a step say; accounting is by activation."""
    added = median(each["accounted"] - each["bare"] for each in rounds)
    return {
        "models": count,
        "us": {way: median(each[way] for each in rounds) for way in WAYS},
        "least_us": {way: min(each[way] for each in rounds) for way in WAYS},
        "accounting_us": added / count,
        "ratio": median(each["accounted"] / each["bare"] for each in rounds),
    }


def step_and_activation(few: dict[str, Any], many: dict[str, Any]) -> dict[str, float]:
    """Accounting's microseconds as a part that every step has, and one that every activation has.

    The line through two summaries, of the least and the greatest number of models.
    """
    a_step = [each["accounting_us"] * each["models"] for each in (few, many)]
    activation = (a_step[1] - a_step[0]) / (many["models"] - few["models"])
    return {"step_us": a_step[0] - activation * few["models"], "activation_us": activation}
