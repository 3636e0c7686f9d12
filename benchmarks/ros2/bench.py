"""How long a value takes over ROS 2, out and back, and the share of each leg.

    firmware-runtime bench ros2 [--count N] [--interval S] [--json] [--save]

Two ends as runs have them, each with its carrier, on this machine; beside them rclpy to rclpy and
back without either. They take turns, so that both meet the same machine.
"""

import argparse
import json
import os
import subprocess
import tempfile
from pathlib import Path
from statistics import median, quantiles
from typing import Any, Final

from benchmarks.ros2.trips import LEGS, trips
from benchmarks.shared.conditions import conditions, conditions_text
from benchmarks.shared.results import add_common_options, save
from benchmarks.shared.side_by_side import positive
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.links.cut.channel import Interpreter
from firmware_runtime.links.ros2.interpreter import command_of, find_environment, variables_of
from firmware_runtime.status import Status

SUMMARY = "How long a value takes over ROS 2, out and back, and the share of each leg."
GOAL_MS: Final = 1.5
PAPER_MS: Final = 7.0
"""A loop over the local network, as the DoveR paper measured it."""
TURNS: Final = 3
_ROOT = Path(__file__).parents[2]


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    add_common_options(parser)
    parser.add_argument("--count", type=positive, default=900, metavar="N", help="of values")
    parser.add_argument(
        "--interval", type=positive_number, default=0.005, metavar="S", help="between two values"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Measure in turns; the ratio to bare rclpy comes last."""
    interpreter = _interpreter()
    linked: list[int] = []
    bare: list[int] = []
    legs: dict[str, list[int]] = {leg: [] for leg in LEGS}
    for _ in range(TURNS):
        with tempfile.TemporaryDirectory(prefix="ros2-") as directory:
            share = -(-arguments.count // TURNS)
            found, parts = trips(interpreter, Path(directory), share, arguments.interval)
        linked += found
        for leg in LEGS:
            legs[leg] += parts[leg]
        bare += _bare(interpreter, share, arguments.interval)
    report = _report(linked, bare, legs)
    save(arguments.save, "ros2", report)
    print(json.dumps(report) if arguments.json else _text(report))
    return Status.OK


def _interpreter() -> Interpreter:
    environment = find_environment(None)
    variables = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", **os.environ}
    variables["PYTHONPATH"] = str(_ROOT)  # benches are in no package that is installed
    return Interpreter(command_of(environment, []), variables_of(environment, variables))


def _bare(interpreter: Interpreter, count: int, interval_s: float) -> list[int]:
    """Round trips of rclpy alone, ns."""
    words = [*interpreter.words, "-m", "benchmarks.ros2.bare"]
    with subprocess.Popen(
        [*words, "pong"], stdin=subprocess.PIPE, env=interpreter.variables
    ) as pong:
        done = subprocess.run(
            [*words, "ping", str(count), str(interval_s)],
            env=interpreter.variables,
            capture_output=True,
            check=True,
        )
        assert pong.stdin is not None  # noqa: S101 -- it is a pipe
        pong.stdin.close()
    found: list[int] = json.loads(done.stdout)
    return found


def _report(linked: list[int], bare: list[int], legs: dict[str, list[int]]) -> dict[str, Any]:
    total = sum(median(legs[leg]) for leg in LEGS)
    return {
        "conditions": conditions(),
        "goal_ms": GOAL_MS,
        "paper_ms": PAPER_MS,
        "link_ms": _ms(linked),
        "bare_ms": _ms(bare),
        "one_way": {leg: {**_ms(legs[leg]), "share": median(legs[leg]) / total} for leg in LEGS},
        "ratio": median(linked) / median(bare),
    }


def _ms(spans: list[int]) -> dict[str, float]:
    cuts = quantiles(spans, n=100)
    return {"count": len(spans), "p50": median(spans) / 1e6, "p99": cuts[98] / 1e6}


def _text(report: dict[str, Any]) -> str:
    lines = [conditions_text(report["conditions"]), ""]
    for what, key in (("out and back, run to run", "link_ms"), ("rclpy alone", "bare_ms")):
        each = report[key]
        lines.append(f"{what:26} p50 {each['p50']:.2f} ms  p99 {each['p99']:.2f} ms")
    lines += ["", "one way, each leg:"]
    lines += [
        f"  {leg:24} p50 {each['p50']:.3f} ms  p99 {each['p99']:.3f} ms  {each['share']:4.0%}"
        for leg, each in report["one_way"].items()
    ]
    p50 = report["link_ms"]["p50"]
    verdict = "met" if p50 <= report["goal_ms"] else "not met"
    lines.append(f"goal: p50 {report['goal_ms']} ms, {verdict}; the paper: {report['paper_ms']} ms")
    lines.append(f"ratio {report['ratio']:.2f}, the p50 of the link by that of rclpy alone")
    return "\n".join(lines)
