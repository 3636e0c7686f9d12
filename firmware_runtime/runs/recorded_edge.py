"""Recording of a run's edge, from the first transfer to the last, where it is kept."""

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from firmware_runtime.board.registry import Board
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.recording.blackbox.recorder import Recorder
from firmware_runtime.recording.blackbox.section import Kind
from firmware_runtime.recording.blackbox.taps import own_atomics
from firmware_runtime.runs.hardware import Hardware, RecordedRobot

if TYPE_CHECKING:
    from firmware_runtime.board.ends import BoardEnd


class RecordedEdge:
    """The recording of one run in the file at `path`; None for a run that is not recorded.

    `recorder` taps lines, clock and events. It is None also if the board's `recording.minutes` are
    0; nothing is done here then. `log` gets what is wrong with a recording, a sentence.
    """

    def __init__(
        self, board: Board, clock: Clock, path: Path | None, log: Callable[[str], None]
    ) -> None:
        is_recorded = path is not None and board.settings.recording.minutes > 0
        self.recorder = Recorder(clock) if is_recorded else None
        self._board = board
        self._path = path
        self._log = log
        self._robot: RecordedRobot | None = None
        self._has_begun = False

    @property
    def kept(self) -> Path | None:
        """Recording of the run, once that has begun; None where it is not recorded."""
        return self._path if self.recorder is not None and self.recorder.is_kept else None

    def section(self, kind: Kind) -> AbstractContextManager[None]:
        """Within the block, what the robot does between two steps is a section of its own."""
        return nullcontext() if self.recorder is None else self.recorder.section(kind)

    def own(self, model: Coupled) -> None:
        """Take what this model has by now for the robot's own; what is added to it is a world's."""
        if self.recorder is not None:
            self.recorder.own = frozenset(own_atomics(model))

    def built(
        self, executive: Executive, robot: Robot, hardware: Hardware, end: "BoardEnd | None"
    ) -> None:
        """The robot has been put together; no chip has been asked."""
        if self.recorder is not None:
            recorded = (self.recorder, executive, robot, hardware.lines)
            self._robot = RecordedRobot(*recorded, self._board, end, hardware.rig)
            self.recorder.built()

    def open(self) -> None:
        """Write into the recording, once the run begins."""
        if self._robot is not None and self._path is not None:
            # a run that is not recorded starts without all that this takes
            from firmware_runtime.runs.black_box import open_black_box  # noqa: PLC0415

            open_black_box(self._robot, self._path, self._log)
            self._has_begun = True

    def retuned(self, settings: Any) -> None:  # noqa: ANN401 -- any board's
        """The robot has taken up settings."""
        if self.recorder is not None:
            self.recorder.retuned(settings)

    def close(self) -> None:
        """Write no more; the recording stays where it is."""
        if self.recorder is not None:
            if (why := self.recorder.warning) is not None:
                self._log(f"warning: this run cannot be replayed as a whole: {why}")
            self.recorder.close()
            if self._path is not None and self._robot is not None and self._has_begun:
                # as above
                from firmware_runtime.runs.black_box import keep  # noqa: PLC0415

                self._has_begun = False
                keep(self._board, self._path, self._log)

    @property
    def said(self) -> str | None:
        """Path of the recording, and where it is kept; None for a run that is not recorded."""
        if self.kept is None or self._path is None or not self._has_begun:
            return None
        from firmware_runtime.recording.blackbox.locations import place_for  # noqa: PLC0415 -- as above

        folder = place_for(self._path, self._board.name)
        if folder is None and not self._path.exists():
            return f"{self._path}, which has been removed since"
        return f"{self._path}" if folder is None else f"{self._path}, and kept in {folder}"

    def keep_into(self, into: Path) -> str | None:
        """Write what is used of the recording into a file; return why it could not be, a sentence.

        Call it once the hardware is released: it may be slow.
        """
        # as above
        from firmware_runtime.runs.kept_recordings import keep_recording  # noqa: PLC0415

        return keep_recording(self.kept, into)

    def keep_start(self, error: BaseException) -> None:
        """Keep what was recorded of a run that has not begun, and will not; once.

        It writes a file, which may take long: outputs are off by then, and the hardware released.
        """
        robot, path = self._robot, self._path
        if robot is not None and path is not None and robot.recorder.before_the_run:
            self._robot = None
            # as above
            from firmware_runtime.runs.kept_recordings import keep_failed_start  # noqa: PLC0415

            keep_failed_start(robot, path, error, self._log)
