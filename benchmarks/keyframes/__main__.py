"""What a capture of a robot's whole state costs, beside a step of the same run.

    python -m benchmarks.keyframes [BOARD [KEY=VALUE ...]] [--captures N] [--json]

The robot on its doubles in virtual time; after 5 s, captures one after the other: CPU time, and how
many steps of this run, doubles and plant included, take as long.
"""

import argparse
import json
from statistics import median, quantiles
from time import thread_time_ns

from benchmarks.keyframes.paused import PausedRun
from benchmarks.shared.conditions import conditions, conditions_text

BOARDS = (
    ("tachobot",),
    ("tachobot", "controller.mode=free"),
    ("tachobot", "controller.mode=track"),
    ("detective",),
)
AFTER_S = 5.0


def measure(run: PausedRun, captures: int) -> dict[str, float]:
    """The figures of one robot."""
    step_us = run.go_on(AFTER_S)
    found: list[float] = []
    for _ in range(captures):
        begin = thread_time_ns()
        run.table.capture()
        found.append((thread_time_ns() - begin) / 1e3)
    middle = median(found)
    return {
        "objects": run.table.objects,
        "kilobytes": len(run.table.capture()) / 1000,
        "p50_us": middle,
        "p99_us": quantiles(found, n=100)[98],
        "step_us": step_us,
        "steps": middle / step_us,
    }


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.keyframes", description=__doc__)
    parser.add_argument("board", nargs="*")
    parser.add_argument("--captures", type=int, default=1000)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    arguments = parser.parse_args()
    report: dict[str, dict[str, float]] = {}
    for board in [tuple(arguments.board)] if arguments.board else BOARDS:
        with PausedRun(*board) as run:
            report[" ".join(board)] = measure(run, arguments.captures)
    if arguments.json:
        print(json.dumps({"conditions": conditions(), "robots": report}))
        return 0
    print(conditions_text(conditions()))
    print(f"\n{'':32}{'objects':>9}{'kB':>7}{'p50 us':>9}{'p99 us':>9}{'steps':>7}")
    for name, row in report.items():
        print(
            f"{name:32}{row['objects']:9.0f}{row['kilobytes']:7.1f}{row['p50_us']:9.0f}"
            f"{row['p99_us']:9.0f}{row['steps']:7.2f}"
        )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
