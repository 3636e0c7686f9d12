"""A periodic model in real time on several engines: `firmware-runtime bench peers`.

Engines take turns, every run in a process of its own. Lateness is counted from the earliest
activation relative to its own schedule, so a constant offset is no lateness; drift is how fast the
activations leave the schedule behind. In a second run the model itself stalls for half a second.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from itertools import takewhile
from statistics import median
from typing import Any

from benchmarks.results import add_common_options, save
from benchmarks.side_by_side import PROJECT, conditions, conditions_text, positive
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.cli.status import Status

SUMMARY = "The same periodic model in real time on this project, xdevs.py and SimPy."
MODULES = {"ours, skip": None, "ours, catch-up": None, "xdevs.py": "xdevs", "SimPy": "simpy"}
"""Engines, and what must be installed for them."""
OURS, PEER = "ours, skip", "xdevs.py"
STALL_NS = 500_000_000
RATES = (100, 1000)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    add_common_options(parser)
    parser.add_argument(
        "--seconds", type=positive_number, default=4.0, metavar="S", help="of one run; default 4"
    )
    parser.add_argument("--repetitions", type=positive, default=3, help="runs of each engine")


def execute(arguments: argparse.Namespace) -> int:
    """Measure; the ratio of the p99 of xdevs.py to ours at 1 kHz comes last."""
    engines = [name for name, module in MODULES.items() if module is None or find_spec(module)]
    missing = [name for name in MODULES if name not in engines]
    if PEER in missing:
        print(
            "firmware-runtime: bench peers: xdevs.py is not installed; "
            "expected it as the extra `bench`: pip install -e '.[bench]'",
            file=sys.stderr,
        )
        return Status.BAD_INPUT
    report: dict[str, Any] = {"conditions": conditions(), "not_installed": missing, "rates": {}}
    for rate_hz in RATES:
        report["rates"][str(rate_hz)] = _measure(rate_hz, engines, arguments)
    fastest = report["rates"][str(RATES[-1])]
    report["ratio"] = fastest[PEER]["quiet"]["p99_us"] / fastest[OURS]["quiet"]["p99_us"]
    save(arguments.save, "peers", report)
    print(json.dumps(report) if arguments.json else "\n".join(_lines(report)))
    return Status.OK


def _measure(
    rate_hz: int, engines: Sequence[str], arguments: argparse.Namespace
) -> dict[str, dict[str, Any]]:
    period_ns = 1_000_000_000 // rate_hz
    periods = max(int(arguments.seconds * rate_hz), 20)
    quiet: dict[str, list[dict[str, Any]]] = {name: [] for name in engines}
    stalled: dict[str, list[dict[str, Any]]] = {name: [] for name in engines}
    for repetition in range(arguments.repetitions):
        for name in engines:
            print(f"bench peers: {rate_hz} Hz, {repetition + 1}: {name}", file=sys.stderr)
            asked = {"period_ns": period_ns, "periods": periods, "stall_at": periods // 4}
            quiet[name].append(quiet_figures(_run(name, {**asked, "stall_ns": 0}), period_ns))
            answer = _run(name, {**asked, "stall_ns": STALL_NS})
            stalled[name].append(stall_figures(answer, period_ns, periods // 4))
    return {
        name: {"quiet": _medians(quiet[name]), "stalled": _medians(stalled[name])}
        for name in engines
    }


def _run(engine: str, asked: Mapping[str, int]) -> dict[str, Any]:
    command = [sys.executable, "-m", "benchmarks.peers_run", engine, json.dumps(asked)]
    done = subprocess.run(command, cwd=PROJECT, check=True, stdout=subprocess.PIPE, text=True)
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def quiet_figures(answer: Mapping[str, Any], period_ns: int) -> dict[str, Any]:
    """Lateness, drift and processor time of a run that nothing disturbed."""
    offsets = [instant - number * period_ns for number, instant in answer["fired"]]
    least = min(offsets)
    late = sorted(offset - least for offset in offsets)
    span_s = (answer["fired"][-1][1] - answer["fired"][0][1]) / 1e9
    return {
        "p50_us": late[len(late) // 2] / 1000,
        "p99_us": late[len(late) * 99 // 100] / 1000,
        "max_us": late[-1] / 1000,
        "drift_ppm": _drift(offsets, len(offsets) * period_ns) * 1e6,
        "cpu": answer["cpu_s"] / span_s,
    }


def stall_figures(answer: Mapping[str, Any], period_ns: int, stall_at: int) -> dict[str, Any]:
    """What a stall in activation `stall_at` did: late events, and how long until none was."""
    fired = answer["fired"]
    before = [instant - number * period_ns for number, instant in fired if number < stall_at]
    usual = median(before)
    stalled_until = next(instant for number, instant in fired if number == stall_at) + STALL_NS
    after = [
        (instant, instant - number * period_ns - usual > period_ns / 2)
        for number, instant in fired
        if number > stall_at
    ]
    late = list(takewhile(lambda each: each[1], after))
    on_time = [instant for instant, is_late in after if not is_late]
    return {
        "late_events": len(late),
        "in_phase_after_ms": (on_time[0] - stalled_until) / 1e6 if on_time else None,
        "told": answer["told"],
    }


def _drift(offsets: Sequence[int], span: int) -> float:
    """How fast the schedule is left behind: from the first tenth's median to the last one's."""
    tenth = max(len(offsets) // 10, 1)
    return (median(offsets[-tenth:]) - median(offsets[:tenth])) / (span * 0.9)


def _medians(runs: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    return {
        name: median(run[name] for run in runs)
        if all(isinstance(run[name], int | float) for run in runs)
        else runs[-1][name]
        for name in runs[0]
    }


def _milliseconds(value: float | None) -> str:
    return "never" if value is None else f"{value:.1f} ms"


def _lines(report: Mapping[str, Any]) -> Sequence[str]:
    lines = [conditions_text(report["conditions"])]
    if report["not_installed"]:
        lines.append(f"not installed: {', '.join(report['not_installed'])} (extra `bench`)")
    for rate_hz, engines in report["rates"].items():
        columns = "".join(f"{column:>9}" for column in ("p50 us", "p99 us", "max us"))
        tail = f"{'drift ppm':>11}{'CPU':>7} | after 500 ms: late events, in phase after, told"
        lines += ["", f"{rate_hz + ' Hz':16}{columns}{tail}"]
        for name, each in engines.items():
            quiet, stalled = each["quiet"], each["stalled"]
            lines.append(
                f"{name:16}{quiet['p50_us']:9.1f}{quiet['p99_us']:9.1f}{quiet['max_us']:9.1f}"
                f"{quiet['drift_ppm']:11.2f}{quiet['cpu']:7.1%} | {stalled['late_events']:.0f}, "
                f"{_milliseconds(stalled['in_phase_after_ms'])}, {stalled['told']}"
            )
    lines += ["", f"ratio {report['ratio']:.1f} (p99 at {RATES[-1]} Hz, {PEER} by {OURS})"]
    return lines
