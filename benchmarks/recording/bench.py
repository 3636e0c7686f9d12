"""What it costs to record a run at its edge: `firmware-runtime bench recording`.

Each board runs on its doubles with and without a recording, in turns, in one process. For the cost
of a step the processor time from the second second on is divided by the steps, on a clock that
waits for nothing; of that clock every reading is recorded, as of the real one. In real time the
lateness of the model that runs most often is compared.
"""

import argparse
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time_ns
from typing import Any

from benchmarks.shared.conditions import conditions, conditions_text
from benchmarks.shared.results import add_common_options, save
from benchmarks.shared.side_by_side import positive
from firmware_runtime.board.in_force import board_in_force
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.devs.time import MICROSECOND, seconds
from firmware_runtime.executive.clocks import Clock, MonotonicClock, VirtualClock
from firmware_runtime.runs.session import Session
from firmware_runtime.statistics.layout import STEPS
from firmware_runtime.status import Status

SUMMARY = "What it costs to record a run at its edge: time of a step, and lateness."
BOARDS = ("tachobot", "detective")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    add_common_options(parser)
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
    """Measure; the ratios come last."""
    before = conditions()
    with TemporaryDirectory(prefix="recording-bench-") as folder:
        path = Path(folder) / "bench.recording"
        found = {board: _measured(board, path, arguments) for board in BOARDS}
    report = {"conditions": before, "boards": found}
    save(arguments.save, "recording", report)
    if arguments.json:
        print(json.dumps(report))
        return Status.OK
    print(conditions_text(before))
    for board, figures in found.items():
        print("\n".join(_text(board, figures)))
    return Status.OK


class _Unwaiting:
    """Virtual time that the recorder does not know from real time."""

    speed: float = 0

    def __init__(self) -> None:
        clock = VirtualClock()
        self.start, self.now, self.wait = clock.start, clock.now, clock.wait


@dataclass(frozen=True, slots=True)
class _Run:
    """One run: processor time of a step, p99 of lateness, and what was recorded in a second."""

    step_us: float
    p99_us: float
    bytes_per_second: float


def _measured(board: str, path: Path, arguments: argparse.Namespace) -> dict[str, Any]:
    virtual = _pairs(board, path, arguments.pairs, arguments.virtual, _Unwaiting)
    real = _pairs(board, path, arguments.pairs, arguments.real, MonotonicClock)
    return {
        "step_us": {name: [each.step_us for each in runs] for name, runs in virtual.items()},
        "step_cost_us": median(
            with_it.step_us - without.step_us
            for with_it, without in zip(virtual["recorded"], virtual["bare"], strict=True)
        ),
        "p99_us": {name: [each.p99_us for each in runs] for name, runs in real.items()},
        "p99_ratio": median(each.p99_us for each in real["recorded"])
        / median(each.p99_us for each in real["bare"]),
        "bytes_per_second": median(each.bytes_per_second for each in virtual["recorded"]),
    }


def _pairs(
    board: str, path: Path, pairs: int, span_s: float, clock: Callable[[], Clock]
) -> dict[str, list[_Run]]:
    """Runs with and without, in turns; who begins changes from pair to pair."""
    found: dict[str, list[_Run]] = {"bare": [], "recorded": []}
    for pair in range(pairs):
        names = ["bare", "recorded"] if pair % 2 == 0 else ["recorded", "bare"]
        for name in names:
            found[name].append(_run(board, path if name == "recorded" else None, span_s, clock()))
    return found


def _run(board: str, path: Path | None, span_s: float, clock: Clock) -> _Run:
    session = Session(
        board_in_force(board, ()), clock, doubles=True, statistics_path=None, recording=path
    )
    try:
        session.run_on(seconds(1))
        before, begun = session.executive.cells[STEPS], process_time_ns()
        session.run_on(seconds(1 + span_s))
        spent = process_time_ns() - begun
        steps = session.executive.cells[STEPS] - before
        session.end()
    finally:
        session.close()
    figures = session.executive.statistics.figures()
    models = figures.models.values()
    busiest = max(models, key=lambda model: model.run)
    recorder = session.recorder
    written = 0 if recorder is None else recorder.written
    return _Run(
        spent / steps / MICROSECOND,
        busiest.lateness_us.p99 or 0.0,
        written / (1 + span_s),
    )


def _text(board: str, figures: dict[str, Any]) -> Iterator[str]:
    bare, recorded = figures["step_us"]["bare"], figures["step_us"]["recorded"]
    yield f"{board}"
    least = f"{min(bare):.1f} us bare, {min(recorded):.1f} us recorded"
    yield f"  processor time of a step: {least} (least)"
    yield f"  recorded in a second: {figures['bytes_per_second'] / 1024:.0f} KiB"
    yield f"  cost of a step: {figures['step_cost_us']:.2f} us (median of pairs; goal 5)"
    p99 = {name: median(values) for name, values in figures["p99_us"].items()}
    yield f"  p99 of lateness: {p99['bare']:.1f} us bare, {p99['recorded']:.1f} us recorded"
    yield f"  ratio of the p99: {figures['p99_ratio']:.3f} (goal 1.02)"
