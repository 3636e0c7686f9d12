"""A periodic model in real time on several engines: `firmware-runtime bench peers`.

Engines take turns, every run in a process of its own, all with the same settings of the system: the
highest scheduling class that is granted, memory locked, timer slack 1 ns, /dev/cpu_dma_latency held
at 0. In a second, shorter run one activation of the model stalls for half a second.
"""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from benchmarks.peers.figures import Round, medians, quiet_figures, ratio, stall_figures
from benchmarks.peers.plan import Plan
from benchmarks.peers.run import ENGINES
from benchmarks.peers.text import peers_lines
from benchmarks.shared.results import conditions, finish, positive
from benchmarks.shared.side_by_side import answer_of, missing_peer, peer_version, turned
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.errors import Status

SUMMARY = "The same periodic model in real time on this project, xdevs.py, SimPy and pyjevsim."
OURS, PEER = "ours, skip", "xdevs.py"
RATES = (100, 1000)
STALL_NS = 500_000_000
STALL_AT_S, STALLED_RUN_S = 0.5, 2.0


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    parser.add_argument(
        "--seconds",
        type=positive_number,
        default=5.0,
        metavar="S",
        help="of one run without a stall; default 5",
    )
    parser.add_argument("--repetitions", type=positive, default=3, help="runs of each; default 3")
    parser.add_argument(
        "--priority",
        type=int,
        choices=range(100),
        default=80,
        metavar="0-99",
        help="of SCHED_FIFO, for all; 0: SCHED_OTHER; default 80",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Measure; the ratio of the p99 of xdevs.py to ours at 1 kHz comes last."""
    engines = [name for name, engine in ENGINES.items() if engine.is_installed]
    if PEER not in engines:
        print(f"firmware-runtime: bench peers: {missing_peer()}", file=sys.stderr)
        return Status.BAD_INPUT
    report: dict[str, Any] = {
        "conditions": conditions(),
        PEER: peer_version(),
        "not_installed": [name for name in ENGINES if name not in engines],
        "rates": {},
    }
    for rate_hz in RATES:
        rounds = [
            _round(rate_hz, number, engines, arguments) for number in range(arguments.repetitions)
        ]
        report["rates"][str(rate_hz)] = medians(rounds)
        report["ratio"] = ratio(rounds, PEER, OURS)
    finish(arguments, "peers", report, peers_lines)
    return Status.OK


def _round(
    rate_hz: int, number: int, engines: Sequence[str], arguments: argparse.Namespace
) -> Round:
    """What one quiet and one stalled run of each say; who is first changes from round to round."""
    period_ns = 1_000_000_000 // rate_hz
    quiet = Plan(period_ns, max(round(arguments.seconds * rate_hz), 2))
    stalled = Plan(period_ns, round(STALLED_RUN_S * rate_hz), round(STALL_AT_S * rate_hz), STALL_NS)
    found = {}
    for name in turned(engines, number):
        print(f"bench peers: {rate_hz} Hz, {number + 1}: {name}", file=sys.stderr)
        found[name] = {
            **quiet_figures(run_once(name, quiet, arguments.priority), quiet),
            **stall_figures(run_once(name, stalled, arguments.priority), stalled),
        }
    return {name: found[name] for name in engines}


def run_once(engine: str, plan: Plan, fifo_priority: int) -> dict[str, Any]:
    """Run one engine once, in a process of its own."""
    asked = json.dumps({"plan": asdict(plan), "fifo_priority": fifo_priority})
    return answer_of("benchmarks.peers.run", engine, asked)
