"""Robot as it was put together for a run, and its recorder: what a recording is made of."""

from msgspec import Struct

from firmware_runtime.board.ends import BoardEnd
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Rig
from firmware_runtime.board.robot import Lines, Robot
from firmware_runtime.executive.executive import Executive
from firmware_runtime.recording.blackbox.recorder import Recorder


class RecordedRobot(Struct, frozen=True):
    """Robot that runs here, and what records it."""

    recorder: Recorder
    executive: Executive
    robot: Robot
    lines: Lines
    board: Board
    end: BoardEnd | None
    rig: Rig | None
    """Its doubles and their world, where they are in this process."""
