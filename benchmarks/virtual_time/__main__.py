"""How fast a whole robot runs in virtual time: TachoBot on its doubles, start-up included.

    python -m benchmarks.virtual_time [--json] [--for SECONDS] [--repetitions N]

Each repetition is a fresh process of the command, so imports count too. Prints the median CPU time
and, last, robot seconds a CPU second.
"""

import argparse
import json
import os
import platform
import resource
import statistics
import subprocess
import sys


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="benchmarks.virtual_time", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--for", type=float, default=30.0, dest="robot_s", help="robot seconds")
    parser.add_argument("--repetitions", type=int, default=5)
    arguments = parser.parse_args()
    runs = [_cpu_seconds(arguments.robot_s) for _ in range(arguments.repetitions)]
    median = statistics.median(runs)
    report = {
        "robot_s": arguments.robot_s,
        "cpu_s": runs,
        "cpu_s_median": median,
        "python": platform.python_version(),
        "machine": platform.machine(),
        "cpus": os.cpu_count(),
        "ratio": arguments.robot_s / median,
    }
    if arguments.json:
        print(json.dumps(report))
    else:
        print(f"{arguments.robot_s:g} s of TachoBot in virtual time, start-up included")
        print(f"CPU seconds: median {median:.2f}, all {', '.join(f'{run:.2f}' for run in runs)}")
        print(f"robot seconds a CPU second: {report['ratio']:.1f}")
    return 0


def _cpu_seconds(robot_s: float) -> float:
    """CPU time of one run of the command, user and system."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", str(robot_s))
    subprocess.run(
        [sys.executable, "-m", "firmware_runtime.cli", *command],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    sys.exit(main())
