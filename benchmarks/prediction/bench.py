"""How well `check --from` predicts when a board's steps are over: seeded boards and computers.

    firmware-runtime bench prediction [--boards 50] [--steps 6000] [--json] [--save]

For each number there is a board (TachoBot or the detective, with chips, periods and bus speeds of
its own) and a computer in virtual time (`machine`), so what is injected is known and a busy machine
changes nothing. The prediction is made from a run on doubles, with the periods and the speed of the
board as shipped; then the board itself runs, and waits for its wires. The ratio is predicted by
measured, of what 999 of 1000 steps keep: 1 or more is an upper bound.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping
from random import Random
from typing import Any

from benchmarks.prediction.machine import Machine, Runs
from benchmarks.shared.results import conditions, finish, positive
from firmware_runtime.board import registry
from firmware_runtime.board.registry import Board
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.runs.timing_prediction import predicted

SUMMARY = "Predicted ends of steps beside those of runs, over seeded boards, in virtual time."
SPEEDS_HZ = (62_500, 100_000, 250_000, 400_000, 650_000, 1_000_000)
GOAL_BOUND, GOAL_WITHIN_TWICE = 0.99, 0.90


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    parser.add_argument("--boards", type=positive, default=50, metavar="N", help="default 50")
    parser.add_argument(
        "--steps", type=positive, default=6000, metavar="N", help="of each run; default 6000"
    )
    parser.add_argument(
        "--first", type=positive, default=1, metavar="N", help="number of the first; default 1"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Predict and run; the shares come last."""
    rows = []
    before = conditions()
    for number in range(arguments.first, arguments.first + arguments.boards):
        print(f"bench prediction: board {number}", file=sys.stderr)
        rows.append(row_of(number, arguments.steps))
    ratios = [row["ratio"] for row in rows]
    report = {
        "conditions": before,
        "boards": rows,
        "bound": sum(ratio >= 1 for ratio in ratios) / len(ratios),
        "within_twice": sum(1 <= ratio <= 2 for ratio in ratios) / len(ratios),
    }
    finish(arguments, "prediction", report, prediction_lines)
    return Status.OK


def row_of(number: int, steps: int) -> dict[str, Any]:
    """Record, predict and measure one board on its computer."""
    shipped, board = boards(number)
    machine = Machine(number)
    recorded = Runs(shipped, machine, 2 * number, steps, wires=False).statistics
    bound_ns = predicted(board, recorded).response_ns
    measured_ns = Runs(board, machine, 2 * number + 1, steps, wires=True).exceeded_by(0.001)
    return {
        "board": board.name,
        "settings": list(board.assignments),
        "predicted_us": bound_ns / 1000,
        "measured_us": measured_ns / 1000,
        "ratio": bound_ns / measured_ns,
    }


def boards(number: int) -> tuple[Board, Board]:
    """Return a seeded board, with periods and speeds as shipped and with its own."""
    random = Random(number)  # noqa: S311 -- no secret
    while True:
        name, chips, timing = _drawn(random)
        try:
            return registry.load(name, chips), registry.load(name, [*chips, *timing])
        except ConfigError:  # its bus would be too full
            continue


def _drawn(random: Random) -> tuple[str, list[str], list[str]]:
    """Return a board's name, its chips, and its periods and speeds."""
    speed = f"buses.i2c1.speed_hz={random.choice(SPEEDS_HZ)}"
    if random.random() < 0.5:
        mode = random.choice(("platform", "free"))
        period_s = random.choice((0.004, 0.005, 0.008, 0.01, 0.0125, 0.02, 0.04))
        return (
            "tachobot",
            [f"controller.mode='{mode}'", "imu.sample_hz=500"],
            [speed, f"controller.period_s={period_s}"],
        )
    compass = random.choice(("cmps12", "hmc5883l"))
    chips = ["radar_compass.chip='hmc5883l'"] if compass == "hmc5883l" else []
    periods = [
        f"body_compass.period_s={random.choice((0.02, 0.03, 0.05, 0.1))}",
        f"radar_sonar.period_s={random.choice((0.066, 0.08, 0.1))}",
        f"body_sonar.period_s={random.choice((0.066, 0.07, 0.09))}",
    ]
    return "detective", chips, [speed, *periods]


def prediction_lines(report: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line for each board, then how often the prediction held."""
    yield f"{'board':10}{'predicted us':>14}{'measured us':>13}{'ratio':>7}  settings"
    for row in sorted(report["boards"], key=lambda row: float(row["ratio"])):
        times = f"{row['predicted_us']:14.0f}{row['measured_us']:13.0f}{row['ratio']:7.2f}"
        yield f"{row['board']:10}{times}  {' '.join(row['settings'])}"
    yield f"an upper bound: {report['bound']:.0%} of boards, goal {GOAL_BOUND:.0%}"
    yield f"and within twice: {report['within_twice']:.0%}, goal {GOAL_WITHIN_TWICE:.0%}"
