"""What it costs to record a run at its edge: `firmware-runtime bench recording`.

Each board runs on its doubles with and without a recording, in turns, in one process. For the cost
of a step the processor time from the second second on is divided by the steps, on a clock that
waits for nothing; of that clock every reading is recorded, as of the real one. A third run of each
pair does not record the doubles' world, so it says what a robot with chips pays. In real time the
lateness of the model that runs most often is compared, and with it how sure that is.
"""

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.recording.lateness import TOLERANCE, compared, text
from benchmarks.recording.runs import AGAIN, BARE, OWN, RECORDED, Run, Unwaiting, least_us, measured
from benchmarks.shared.results import (
    conditions,
    finish,
    positive,
)
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.errors import Status
from firmware_runtime.executive.clocks import MonotonicClock

SUMMARY = "What it costs to record a run at its edge: time of a step, and lateness."
BOARDS = ("tachobot", "detective")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    parser.add_argument("--pairs", type=positive, default=10, metavar="N", help="default 10")
    parser.add_argument(
        "--virtual",
        type=positive_number,
        default=10.0,
        metavar="S",
        help="of each run in virtual time; default 10",
    )
    parser.add_argument(
        "--real",
        type=positive_number,
        default=4.0,
        metavar="S",
        help="of each run in real time; default 4",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Measure; the ratios of a board come last."""
    before = conditions()
    with TemporaryDirectory(prefix="recording-bench-") as folder:
        found = {board: _measured(board, Path(folder), arguments) for board in BOARDS}
    report = {"conditions": before, "boards": found}
    finish(arguments, "recording", report, _lines)
    return Status.OK


def _measured(board: str, folder: Path, arguments: argparse.Namespace) -> dict[str, Any]:
    def in_virtual_time(name: str) -> Run:
        return measured(board, folder, name, arguments.virtual, Unwaiting())

    def in_real_time(name: str) -> Run:
        return measured(board, folder, name, arguments.real, MonotonicClock())

    virtual = _in_turns((BARE, RECORDED, OWN), arguments.pairs, in_virtual_time)
    real = _in_turns((BARE, RECORDED, AGAIN), arguments.pairs, in_real_time)
    lateness = {
        "p50": {name: [each.p50_us for each in runs] for name, runs in real.items()},
        "p99": {name: [each.p99_us for each in runs] for name, runs in real.items()},
    }
    return {
        "step_us": {name: [each.step_us for each in runs] for name, runs in virtual.items()},
        "step_cost_us": median(
            with_it.step_us - without.step_us
            for with_it, without in zip(virtual[RECORDED], virtual[BARE], strict=True)
        ),
        "least_cost_us": {name: _least_cost(virtual, name) for name in (RECORDED, OWN)},
        "lateness_us": lateness,
        "lateness_ratio": {
            quantile: {name: compared(runs, name, BARE) for name in (RECORDED, AGAIN)}
            for quantile, runs in lateness.items()
        },
        "bytes_per_second": median(each.bytes_per_second for each in virtual[RECORDED]),
    }


def _in_turns(names: Sequence[str], pairs: int, run: Callable[[str], Run]) -> dict[str, list[Run]]:
    """Runs of each kind in turns; who begins changes from one turn to the next."""
    found: dict[str, list[Run]] = {name: [] for name in names}
    for pair in range(pairs):
        for name in names if pair % 2 == 0 else reversed(names):
            found[name].append(run(name))
    return found


def _least_cost(runs: dict[str, list[Run]], name: str) -> dict[str, float]:
    """What is longer than without a recording: the step, and what is done between two steps."""
    with_it, without = runs[name], runs[BARE]
    return {
        "within": least_us([each.within for each in with_it])
        - least_us([each.within for each in without]),
        "between": least_us([each.between for each in with_it])
        - least_us([each.between for each in without]),
    }


def _lines(report: Mapping[str, Any]) -> Iterator[str]:
    for board, figures in report["boards"].items():
        yield from _of_board(board, figures)


def _of_board(board: str, figures: dict[str, Any]) -> Iterator[str]:
    bare, recorded = figures["step_us"][BARE], figures["step_us"][RECORDED]
    yield f"{board}"
    least = f"{min(bare):.1f} us bare, {min(recorded):.1f} us recorded"
    yield f"  processor time of a step: {least} (least)"
    yield f"  recorded in a second: {figures['bytes_per_second'] / 1024:.0f} KiB"
    yield f"  cost of a step: {figures['step_cost_us']:.2f} us (median of pairs; goal 5)"
    both, own = figures["least_cost_us"][RECORDED], figures["least_cost_us"][OWN]
    where = f"{both['within']:.2f} us within it, {both['between']:.2f} us before the next"
    yield f"  of each step the least of all runs: {where}"
    where = f"{own['within']:.2f} us within it, {own['between']:.2f} us before the next"
    yield f"  without the doubles' world, as a robot with chips: {where}"
    for quantile, us in figures["lateness_us"].items():
        both = f"{median(us[BARE]):.1f} us bare, {median(us[RECORDED]):.1f} us recorded"
        yield f"  {quantile} of lateness: {both} (medians of {len(us[BARE])} runs)"
    for quantile, ratios in figures["lateness_ratio"].items():
        for name, ratio in ratios.items():
            yield f"  {quantile}, {name} by bare: {text(ratio, len(bare))}"
    said = figures["lateness_ratio"]["p99"][RECORDED]["verdict"]
    yield f"  goal of the p99, {1 + TOLERANCE:g} at most: {said}"
