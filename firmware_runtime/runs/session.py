"""One robot put together for one run: its lines, its model, its executive, and how they end."""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_runtime.board.ending import Ending
from firmware_runtime.board.ends import BoardEnd
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Rig
from firmware_runtime.board.rigs import shown_by
from firmware_runtime.board.robot import Robot
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.executive.clocks import WorldClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.recording.blackbox.recorder import Recorder
from firmware_runtime.runs.arming import Arming
from firmware_runtime.runs.end_link import LinkedEnd
from firmware_runtime.runs.exit_in_model import quitting_is_a_bug
from firmware_runtime.runs.hardware import Hardware
from firmware_runtime.runs.recorded_edge import RecordedEdge
from firmware_runtime.runs.switching_off import SwitchingOff
from firmware_runtime.runs.task import Task
from firmware_runtime.runs.tuning import Tuning

if TYPE_CHECKING:
    from firmware_runtime.links.dover.dover import DoverLink


@dataclass(frozen=True, kw_only=True)
class Session:
    """A robot whose chips have answered, ready to run: what `start_session` has put together.

    What is open until the run is over is released by `undo`, the last first.
    """

    board: Board
    end_of_board: BoardEnd | None
    """The part of the board's model that runs here; None for all of it."""
    edge: RecordedEdge
    hardware: Hardware
    switching_off: SwitchingOff
    replaced: str | None
    """What is wrong with the file that this run's statistics replace, if it is damaged."""
    robot: Robot
    executive: Executive
    task: Task
    dover: "DoverLink | None"
    """What the model's blocks of `models.dover` send and receive; None if it has none."""
    linked: LinkedEnd | None
    arming: Arming | None
    tuning: Tuning
    undo: ExitStack

    @property
    def rig(self) -> Rig | None:
        """The doubles that were made for this run, and their world."""
        return self.hardware.rig

    @property
    def world_now(self) -> WorldClock:
        """The instant that doubles and their world live in."""
        return self.hardware.world_now

    @property
    def has_hardware(self) -> bool:
        """Whether chips, or doubles of them, are at this end."""
        return self.hardware.is_here

    @property
    def recorder(self) -> Recorder | None:
        """What taps the edge of a run that is recorded."""
        return self.edge.recorder

    @property
    def recording(self) -> Path | None:
        """Where the recording of the run is, once that has begun; None where it is not recorded."""
        return self.edge.kept

    @property
    def recorded_in(self) -> str | None:
        """Where the recording is and is kept, in words; None where there is none."""
        return self.edge.said

    @property
    def is_outside(self) -> bool:
        """Whether its outputs are outside of this process, on chips or on doubles that are served.

        They stay as they are while nothing runs here, and others can switch them off.
        """
        return self.hardware.is_outside

    @property
    def supervision(self) -> Arming | None:
        """What lets a run drive that may not drive of itself; None for any other."""
        return None if self.arming is None or self.arming.is_free else self.arming

    @property
    def shown(self) -> OutPort[float] | None:
        """The port whose values a person wants to see over time, if there is one."""
        return self.robot.shown if self.rig is None else shown_by(self.rig, self.board)

    @property
    def ending(self) -> Ending | None:
        """How the robot's task was over, if it is."""
        return self.task.ending

    @property
    def has_failed(self) -> bool:
        """Whether the robot itself ended the run because something went wrong."""
        return self.task.has_failed

    def run(self, until: int) -> Outcome:
        """Run up to and including instant `until`; outputs are off when it returns.

        Raises ModelError for a model that would have ended the program without a word.
        """
        self.switching_off.leave_word()
        try:
            with quitting_is_a_bug(self.robot.model):
                return self._parted(self.executive.run(until))
        finally:
            self.switching_off.leave_no_word()

    def run_on(self, until: int) -> Outcome:
        """Run to instant `until` and pause there; again, go on to a later one.

        Outputs outside of this process are off in a pause, and the run is armed again when it goes
        on; if they cannot be switched off, the run ends. In a world within this process nothing
        passes, so nothing has to be off.
        """
        if self.executive.reached == 0:
            self.switching_off.leave_word()
        try:
            outcome = self.executive.run_on(until)
        finally:
            if self.executive.is_over:
                self.switching_off.leave_no_word()
        if self.executive.is_over:
            return self._parted(outcome)
        if self.arming is not None and self.is_outside and self.arming.pause():
            return self.end() or outcome
        return outcome

    def end(self) -> Outcome | None:
        """End a paused run with all outputs off; None if it never began or is over."""
        outcome = self.executive.end()
        if outcome is not None:
            self.switching_off.leave_no_word()
            self._parted(outcome)
        return outcome

    def result(self) -> dict[str, object]:
        """How the run ended: the world's truth on doubles, else what the robot itself knows."""
        return self.hardware.result(self.robot.own_result())

    def outputs(self) -> dict[str, int] | None:
        """How many outputs of each chip are on; None where that is unknown."""
        return self.hardware.outputs()

    def make_safe(self) -> list[str]:
        """Disable all outputs at once where a line can, then write full-off to every chip.

        Returns what failed, one sentence each.
        """
        return self.switching_off.all_of(self.robot)

    def close(self) -> None:
        """Release sockets, buses and doubles that are served, with outputs off.

        What has run has switched off at its end; what has not does so here, and logs what fails.
        """
        self.undo.close()

    def _parted(self, outcome: Outcome) -> Outcome:
        """The run is over: the other end learns of it, and why."""
        if self.linked is not None:
            self.linked.say_goodbye(outcome, self.ending)
        return outcome
