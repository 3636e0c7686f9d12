"""DEVStone and the hold model, side by side with xdevs.py: `firmware-runtime bench devstone`.

CPU seconds of each engine, set-up included, medians over runs in fresh processes that take turns;
beside the ratio of these, that of the run alone. Both engines' transitions are checked against the
published formulas, or the arithmetic. The hold model is N atomics that only wait: it shows what
finding the next one costs as N grows.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any

from benchmarks.devstone import shapes
from benchmarks.devstone.models import SHAPES
from benchmarks.hold import measure as hold
from benchmarks.shared.results import (
    conditions,
    finish,
    positive,
)
from benchmarks.shared.side_by_side import (
    OURS,
    PEER,
    WrongCountError,
    missing_peer,
    peer_version,
)
from firmware_runtime.errors import Status

SUMMARY = "The kernel beside xdevs.py: DEVStone's shapes, and models that only wait."
GOALS = {"HI": 11.0, "HO": 11.0, "HOmod": 11.0, "hold 50 distinct": 30.0}
"""How many times as much CPU time the peer is to take."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    parser.add_argument(
        "--shapes", nargs="*", choices=list(SHAPES), default=list(SHAPES), help="default: all"
    )
    parser.add_argument(
        "--hold",
        nargs="*",
        type=positive,
        default=list(hold.COUNTS),
        metavar="N",
        help="numbers of waiting models; default 1 10 50 200 1000",
    )
    parser.add_argument("--width", type=positive, help="atomics a level; default 200, for HOmod 20")
    parser.add_argument("--depth", type=positive, default=20, help="levels; default 20")
    parser.add_argument("--repetitions", type=positive, default=5, help="runs of each engine")


def execute(arguments: argparse.Namespace) -> int:
    """Measure; the ratio that is worst beside its goal comes last."""
    if peer_version() is None:
        print(missing_peer(), file=sys.stderr)
        return Status.BAD_INPUT
    report: dict[str, Any] = {"conditions": conditions(), "goals": GOALS, "models": []}
    try:
        for name, measure in _measurements(arguments).items():
            print(f"bench devstone: {name}", file=sys.stderr)
            report["models"].append({"name": name, **measure()})
    except WrongCountError as error:
        print(f"firmware-runtime: bench devstone: {error}", file=sys.stderr)
        return Status.MODEL_ERROR
    report.update(_verdict(report["models"]))
    lines = partial(_lines, repetitions=arguments.repetitions)
    finish(arguments, "devstone", report, lines)
    return Status.OK


def _measurements(arguments: argparse.Namespace) -> dict[str, Any]:
    """What is to be measured, by name."""
    wanted: dict[str, Any] = {}
    for shape in arguments.shapes:
        width = arguments.width or shapes.WIDTHS[shape]
        wanted[shape] = lambda shape=shape, width=width: shapes.measure(
            shape, width, arguments.depth, arguments.repetitions
        )
    for kind in hold.KINDS:
        for count in arguments.hold:
            wanted[f"hold {count} {kind}"] = lambda kind=kind, count=count: hold.measure(
                kind, count, arguments.repetitions
            )
    return wanted


def _verdict(models: list[dict[str, Any]]) -> dict[str, Any]:
    """The ratio that is worst beside its goal; of models without a goal, the least."""
    if not models:
        return {"worst": None, "ratio": None}
    stated = [each for each in models if each["name"] in GOALS]
    worst = (
        min(stated, key=lambda each: each["ratio"] / GOALS[each["name"]])
        if stated
        else min(models, key=lambda each: each["ratio"])
    )
    return {"worst": worst["name"], "ratio": worst["ratio"]}


def _lines(report: Mapping[str, Any], repetitions: int) -> Iterator[str]:
    yield f"CPU time, set-up included, medians of {repetitions} runs each\n"
    yield f"{'':20}{'transitions':>12}{OURS:>18}{PEER:>12}{'ratio':>8}{'goal':>6}{'run alone':>11}"
    for each in report["models"]:
        ours, peer = (
            each["seconds"][engine]["total"] / each["transitions"] * 1e6 for engine in (OURS, PEER)
        )
        goal = f"{GOALS[each['name']]:g}" if each["name"] in GOALS else ""
        yield (
            f"{each['name']:20}{each['transitions']:12}{ours:15.3f} us{peer:9.2f} us"
            f"{each['ratio']:8.1f}{goal:>6}{each['run_ratio']:11.1f}"
        )
    yield ""
    yield from _growth(report["models"])
    if report["ratio"] is not None:
        aim = f", goal {GOALS[report['worst']]:g}" if report["worst"] in GOALS else ""
        yield f"ratio {report['ratio']:.1f} ({report['worst']}{aim})"


def _growth(models: list[dict[str, Any]]) -> list[str]:
    """How much dearer a transition is among the most models than among the fewest."""
    held = [each for each in models if each["name"].endswith("distinct")]
    if len(held) < 2:
        return []
    few, many = held[0], held[-1]
    grown = {
        engine: many["seconds"][engine]["total"]
        / many["transitions"]
        / (few["seconds"][engine]["total"] / few["transitions"])
        for engine in (OURS, PEER)
    }
    from_to = f"from {few['name']} to {many['name']}"
    ours = f"a transition takes {grown[OURS]:.1f} times as long"
    return [f"{from_to} {ours}; {PEER}: {grown[PEER]:.0f} times"]
