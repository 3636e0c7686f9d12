"""`firmware-runtime check BOARD`: read a board, build its robot, add up bus time, touch nothing."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_runtime.board.configuration import described, input_timeouts
from firmware_runtime.board.ends import check_ends
from firmware_runtime.board.registry import Board
from firmware_runtime.board.ros.topics import topics_of
from firmware_runtime.cli.arguments import SubParsers, add_board, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.errors import Status
from firmware_runtime.recording.blackbox.state_of_run import why_unkeepable
from firmware_runtime.runs.board_check import put_together, recording_said
from firmware_runtime.runs.measured_wires import clock_warnings
from firmware_runtime.runs.unknown_names import unknown_names

if TYPE_CHECKING:
    from firmware_runtime.runs.timing_prediction import Prediction


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Check a board's settings and bus load; list every fault found."
    verb = add_verb(verbs, "check", summary, execute)
    add_board(verb)
    verb.add_argument(
        "--from",
        type=Path,
        metavar="FILE",
        dest="recorded",
        help="predict when steps are over from the own times and the lateness in this statistics "
        "file, of a run of this board on the robot's computer (run --statistics FILE)",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Print what the board asks of its buses; ConfigError lists the faults if there are any."""
    board = chosen_board(arguments.board, arguments.assignments)
    put_together(board)
    lines = board.absent_lines()
    robot = board.build(lines)
    unkept = why_unkeepable(robot, lines)
    check_ends(board)
    topics = topics_of(board)
    warnings = [*board.warnings, *clock_warnings(board), *unknown_names(board)]
    timing = None if arguments.recorded is None else _predicted(board, arguments.recorded)
    print(f"{board.name}: {board.source} is sound")
    for load in board.loads.values():
        overhead = f" and {load.overhead_ns / 1e3:g} us a transaction" if load.overhead_ns else ""
        share = f"{load.utilisation:.1%} of its time" if load.transactions else "no load is stated"
        print(f"  {load.name}: {share} at {load.bus_hz} Hz{overhead}")
        recurring = dict.fromkeys((each.what, each.period_ns) for each in load.transactions)
        for what, period_ns in recurring:
            print(f"    {what} every {period_ns / 1e6:g} ms")
    for name, timeout in input_timeouts(board, robot).items():
        print(f"  {described(name, timeout)}")
    if timing is not None:
        print(f"  predicted: {timing.sentence()}")
        warnings += filter(None, [timing.warning()])
    print(f"  recording: {recording_said(board)}")
    counts = f"{len(topics.publications)} published, {len(topics.subscriptions)} taken"
    print(f"  ros2 topics: {counts}")
    if unkept is not None:
        warnings.append(f"its runs have no keyframes and are replayed from their start: {unkept}")
    for warning in warnings:
        print(f"  warning: {warning}")
    return Status.OK


def _predicted(board: Board, recorded: Path) -> "Prediction":
    # few checks predict
    from firmware_runtime.runs.timing_prediction import predicted  # noqa: PLC0415
    from firmware_runtime.statistics.reader import read_statistics  # noqa: PLC0415

    return predicted(board, read_statistics(recorded))
