"""How fast a whole robot runs in virtual time: TachoBot on its doubles, start-up included.

    python -m benchmarks.virtual_time [--base PYTHON] [--json] [--for SECONDS] [--repetitions N]

Each repetition is a fresh process of the command, so imports count too. Prints the median CPU time
and, last, robot seconds a CPU second. With `--base`, the interpreter of another checkout's
environment, such as ../base/.venv/bin/python, both take turns, and what is printed last is the
ratio of their CPU times, pair by pair: below 1, this one takes less.
"""

import argparse
import json
import os
import platform
import resource
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.virtual_time", description=__doc__)
    parser.add_argument("--base", metavar="PYTHON", help="another checkout's, to take turns with")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--for", type=float, default=30.0, dest="robot_s", help="robot seconds")
    parser.add_argument("--repetitions", type=int, default=5)
    arguments = parser.parse_args()
    base = None if arguments.base is None else str(Path(arguments.base).absolute())
    report = _measured(base, arguments.robot_s, arguments.repetitions)
    print(json.dumps(report) if arguments.json else _as_text(report))
    return 0


def _measured(base: str | None, robot_s: float, repetitions: int) -> dict[str, Any]:
    """Times in s, of this checkout and of the base in turns, after one run of each to warm up."""
    pythons = [sys.executable] if base is None else [sys.executable, base]
    for python in pythons:
        _cpu_seconds(python, robot_s)
    rounds = [[_cpu_seconds(each, robot_s) for each in pythons] for _ in range(repetitions)]
    runs = [each[0] for each in rounds]
    report: dict[str, Any] = {
        "robot_s": robot_s,
        "cpu_s": runs,
        "cpu_s_median": statistics.median(runs),
        "python": platform.python_version(),
        "machine": platform.machine(),
        "cpus": os.cpu_count(),
        "ratio": robot_s / statistics.median(runs),
    }
    if base is not None:
        report["base_cpu_s"] = [each[1] for each in rounds]
        ratios = [ours / theirs for ours, theirs in rounds]
        report["by_base"] = {
            "median": statistics.median(ratios),
            "min": min(ratios),
            "max": max(ratios),
        }
    return report


def _as_text(report: dict[str, Any]) -> str:
    """The report for people, the ratio last."""
    lines = [
        f"{report['robot_s']:g} s of TachoBot in virtual time, start-up included",
        f"CPU seconds: {_row(report['cpu_s'])}",
        f"robot seconds a CPU second: {report['ratio']:.1f}",
    ]
    if "by_base" in report:
        by_base = report["by_base"]
        lines.append(f"CPU seconds of the base: {_row(report['base_cpu_s'])}")
        lines.append(
            f"by the base, pair by pair: {by_base['median']:.2f} "
            f"({by_base['min']:.2f} to {by_base['max']:.2f})"
        )
    return "\n".join(lines)


def _row(runs: list[float]) -> str:
    every = ", ".join(f"{run:.2f}" for run in runs)
    return f"median {statistics.median(runs):.2f}, all {every}"


def _cpu_seconds(python: str, robot_s: float) -> float:
    """CPU time of one run of the command, user and system."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", str(robot_s))
    subprocess.run(
        [python, "-m", "firmware_runtime.cli", *command],
        check=True,
        stdout=subprocess.DEVNULL,
        cwd="/",  # where no checkout is, so that each takes its own
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    sys.exit(main())
