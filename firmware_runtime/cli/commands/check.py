"""`firmware-runtime check BOARD`: read a board, build its robot, add up bus time, touch nothing."""

import argparse

from firmware_runtime.board.configuration import configuration_of
from firmware_runtime.board.ends import check_ends
from firmware_runtime.board.inputs import described, input_timeouts
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rigs import has_rig
from firmware_runtime.board.ros.topics import topics_of
from firmware_runtime.cli.arguments import SubParsers, add_board, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.errors import Status
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.recording.blackbox.size import seconds_held, size_for
from firmware_runtime.recording.blackbox.state_of_run import why_unkeepable
from firmware_runtime.runs.start import start_session
from firmware_runtime.runs.unknown_names import unknown_names


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Check a board's settings and bus load; list every fault found."
    add_board(add_verb(verbs, "check", summary, execute))


def execute(arguments: argparse.Namespace) -> int:
    """Print what the board asks of its buses; ConfigError lists the faults if there are any."""
    board = chosen_board(arguments.board, arguments.assignments)
    _put_together(board)
    lines = board.absent_lines()
    robot = board.build(lines)
    unkept = why_unkeepable(robot, lines)
    check_ends(board)
    topics = topics_of(board)
    warnings = [*board.warnings, *unknown_names(board)]
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
    print(f"  recording: {_recording(board)}")
    counts = f"{len(topics.publications)} published, {len(topics.subscriptions)} taken"
    print(f"  ros2 topics: {counts}")
    if unkept is not None:
        warnings.append(f"its runs have no keyframes and are replayed from their start: {unkept}")
    for warning in warnings:
        print(f"  warning: {warning}")
    return Status.OK


def _recording(board: Board) -> str:
    """How much of a run is kept, and the memory that it takes."""
    minutes = board.settings.recording.minutes
    if minutes <= 0:
        return "none: recording.minutes is 0"
    mebibytes = size_for(board.loads.values(), minutes).bytes / (1 << 20)
    seconds = minutes * 60
    asked = f"{minutes:g} min" if minutes >= 1 else f"{seconds:g} s"
    held = seconds_held(board.loads.values(), minutes)
    if unstated := [name for name, load in board.loads.items() if not load.transactions]:
        return (
            f"{mebibytes:.0f} MiB; whether {asked} fit is not known, for no load of "
            f"{', '.join(unstated)} is stated"
        )
    if held < seconds:
        return f"the last {held / 60:.0f} of {asked} in {mebibytes:.0f} MiB, which is the most"
    return f"the last {asked} in {mebibytes:.0f} MiB"


def _put_together(board: Board) -> None:
    """Put the robot together as for a run: on its doubles if it has any, else on no lines.

    Raises what a run would, before it began.
    """
    if has_rig(board):
        start_session(board, VirtualClock(), doubles=True, statistics_path=None).close()
        return
    lines = board.absent_lines()
    configuration_of(board, board.build(lines).model, lines)
