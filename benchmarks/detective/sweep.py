"""Whether the detective robot finds its target wherever it stands, and what that costs.

    python -m benchmarks.detective.sweep [--json] [--step DEGREES] [--distances M ...]

Targets stand at every bearing (72 of them) at 1, 2 and 4 m; each mission runs in virtual time on
register-level doubles with a seed of its own. A mission counts as found when the robot says so, has
touched nothing, and stands between 0.05 m and 0.5 m in front of the target. Prints what was not
found, the CPU time of the sweep, and last how many were found.
"""

import argparse
import json
import sys
import time

from tests.support.virtual_detective import target_at, virtual_detective


def main() -> int:
    """Sweep and print; the exit status is 1 if any target was not found."""
    parser = argparse.ArgumentParser(prog="benchmarks.detective.sweep", description=__doc__)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--step", type=int, default=5, help="degrees from bearing to bearing")
    parser.add_argument("--distances", type=float, nargs="+", default=[1.0, 2.0, 4.0], metavar="M")
    arguments = parser.parse_args()
    missions = [
        (distance_m, bearing_deg)
        for distance_m in arguments.distances
        for bearing_deg in range(0, 360, arguments.step)
    ]
    begun = time.process_time()
    results = [_mission(number, *mission) for number, mission in enumerate(missions)]
    report = _report(results, time.process_time() - begun)
    print(json.dumps(report) if arguments.json else _text(report))
    return 0 if report["found"] == len(missions) else 1


def _mission(number: int, distance_m: float, bearing_deg: int) -> dict[str, object]:
    robot = virtual_detective(target_at(bearing_deg, distance_m), f"world.seed={number}")
    return {"distance_m": distance_m, "bearing_deg": bearing_deg, **robot.run_mission()}


def _report(results: list[dict[str, object]], cpu_s: float) -> dict[str, object]:
    stopped = [float(str(each["stopped_m"])) for each in results if each["found"]]
    return {
        "missions": len(results),
        "found": len(stopped),
        "not_found": [each for each in results if not each["found"]],
        "nearest_stop_m": min(stopped, default=None),
        "farthest_stop_m": max(stopped, default=None),
        "longest_s": max(float(str(each["time_s"])) for each in results),
        "cpu_s": cpu_s,
    }


def _text(report: dict[str, object]) -> str:
    missed = report["not_found"]
    lines = [f"not found: {each}" for each in missed] if isinstance(missed, list) else []
    lines += [
        f"stopped {report['nearest_stop_m']:.3f} to {report['farthest_stop_m']:.3f} m in front",
        f"longest mission {report['longest_s']:.0f} s; CPU of the sweep {report['cpu_s']:.1f} s",
        f"found {report['found']} of {report['missions']}",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
