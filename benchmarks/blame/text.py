"""The confusion matrix for people: a row for each cause injected, a column for each named."""

from collections.abc import Mapping
from typing import Any

from benchmarks.blame.causes import INJECTED
from benchmarks.shared.conditions import conditions_text

JUDGEMENTS = ("right", "unknown", "wrong")


def report_text(report: Mapping[str, Any]) -> str:
    """The whole report, the least share of right ones last."""
    rows = report["causes"]
    run = {cause: row for cause, row in rows.items() if "named" in row}
    names = list(dict.fromkeys(name for row in run.values() for name in row["named"]))
    lines = [
        conditions_text(report["conditions"]),
        f"Each injected {report['times']} times; how often which cause was named:",
        *_table(run, names),
        *(
            f"  {cause}: not run: {row['not_run']}"
            for cause, row in rows.items()
            if "named" not in row
        ),
        f"  named right, of those that were late: {report['wanted']:.0%} or more is wanted of each",
        *(line for cause, row in run.items() for line in _not_right_ones(cause, row)),
    ]
    least = report["least_share"]
    return "\n".join([*lines, "ratio none" if least is None else f"ratio {least:.2f} (the least)"])


def _percent(number: int, late: int) -> str:
    return "-" if late == 0 else f"{number / late:.0%}"


def _table(run: Mapping[str, Any], names: list[str]) -> list[str]:
    head = ["injected", "right name", *names, "right", "unknown", "wrong"]
    rows = [
        [
            cause,
            INJECTED[cause].right.value,
            *(str(row["named"].get(name, "")) for name in names),
            *(_percent(row[judgement], row["late"]) for judgement in JUDGEMENTS),
        ]
        for cause, row in run.items()
    ]
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    return [
        "  "
        + "  ".join(
            cell.ljust(width) if number < 2 else cell.rjust(width)
            for number, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in (head, *rows)
    ]


def _not_right_ones(cause: str, row: Mapping[str, Any]) -> list[str]:
    """What was not named right, each with the evidence for it."""
    return [
        f"  {cause} at {each['t_s']:.3f} s was named {each['cause']}, "
        f"{each['explained_us'] / 1000:.2f} ms of {each['of_us'] / 1000:.2f} ms: "
        + ", ".join(f"{name} {value:g}" for name, value in each["evidence"].items() if value)
        for each in row["not_right"]
    ]
