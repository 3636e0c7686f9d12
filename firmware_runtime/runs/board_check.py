"""A board put together as for a run, and how much of a run is kept, for its check."""

from firmware_runtime.board.configuration import configuration_of
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rigs import has_rig
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.recording.blackbox.layout import seconds_held, size_for
from firmware_runtime.runs.start import start_session


def recording_said(board: Board) -> str:
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


def put_together(board: Board) -> None:
    """Put the robot together as for a run: on its doubles if it has any, else on no lines.

    Raises what a run would, before it began.
    """
    if has_rig(board):
        start_session(board, VirtualClock(), doubles=True, statistics_path=None).close()
        return
    lines = board.absent_lines()
    configuration_of(board, board.build(lines).model, lines)
