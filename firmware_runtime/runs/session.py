"""One robot put together for one run: its lines, its model, its executive, and how they end."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from msgspec import Struct

from firmware_runtime.board.registry import Board
from firmware_runtime.board.rigs import shown_by
from firmware_runtime.board.robot import Ending, Robot
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.ports import OutPort
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.runs.arming import Arming
from firmware_runtime.runs.hardware import Hardware
from firmware_runtime.runs.local_robot import SwitchingOff
from firmware_runtime.runs.recorded_edge import RecordedEdge
from firmware_runtime.runs.supervision import RightToDrive
from firmware_runtime.runs.tuning import Tuning
from firmware_runtime.system.signals import Signalled

if TYPE_CHECKING:
    from firmware_runtime.board.ends import BoardEnd
    from firmware_runtime.runs.end_link import LinkedEnd


@contextmanager
def quitting_is_a_bug(model: Component) -> Iterator[None]:
    """Raise ModelError for a SystemExit from a run whose signals are taken: a model raised it."""
    try:
        yield
    except Signalled:
        raise
    except SystemExit as error:
        found = f"{model.path}: a model raised SystemExit({error.code!r})"
        raise ModelError(found, expected="none: it would end the program") from error


class Task:
    """Task of a robot in one run, which ends the run: `ending` is how, once it is over."""

    def __init__(self, executive: Executive, robot: Robot) -> None:
        self.ending: Ending | None = None
        self._executive = executive
        self._ends_on_failure = robot.ends_on_failure
        if robot.ended is not None:
            executive.simulator.listen(robot.ended, self._end_by_model)

    @property
    def has_failed(self) -> bool:
        """Return whether it is over because something went wrong."""
        return self.ending is not None and self.ending.failed

    def end_with(self, ending: Ending) -> None:
        """End the run: its task is over, here or at the other end."""
        self.ending = ending
        self._executive.request_stop(ending.reason)

    def _end_by_model(self, _at: int, ending: Ending) -> None:
        if self._ends_on_failure or not ending.failed:
            self.end_with(ending)


class Session(Struct, frozen=True, kw_only=True):
    """A robot whose chips have answered, ready to run: what `start_session` has put together.

    What is open until the run is over is released by `undo`, the last first.
    """

    board: Board
    end_of_board: "BoardEnd | None"
    """The part of the board's model that runs here; None for all of it."""
    edge: RecordedEdge
    hardware: Hardware
    switching_off: SwitchingOff
    replaced: str | None
    """What is wrong with the file that this run's statistics replace, if it is damaged."""
    robot: Robot
    executive: Executive
    task: Task
    linked: "LinkedEnd | None"
    right: RightToDrive
    tuning: Tuning
    undo: ExitStack

    @property
    def arming(self) -> Arming | None:
        """What decides whether it may drive; None where nothing does, as on doubles of its own."""
        return self.right.arming

    @property
    def shown(self) -> OutPort[float] | None:
        """The port whose values a person wants to see over time, if there is one."""
        rig = self.hardware.rig
        return self.robot.shown if rig is None else shown_by(rig, self.board)

    def run(self, until: int) -> Outcome:
        """Run up to and including instant `until`; outputs are off when it returns.

        Raises ModelError for a model that would have ended the program without a word.
        """
        self.switching_off.keep_settings()
        try:
            with quitting_is_a_bug(self.robot.model):
                return self._parted(self.executive.run(until))
        finally:
            self.switching_off.forget_settings()

    def run_on(self, until: int) -> Outcome:
        """Run to instant `until` and pause there; again, go on to a later one.

        Outputs outside of this process are off in a pause, and the run is armed again when it goes
        on; if they cannot be switched off, the run ends. In a world within this process nothing
        passes, so nothing has to be off.
        """
        if self.executive.reached == 0:
            self.switching_off.keep_settings()
        try:
            outcome = self.executive.run_on(until)
        finally:
            if self.executive.is_over:
                self.switching_off.forget_settings()
        if self.executive.is_over:
            return self._parted(outcome)
        if self.arming is not None and self.hardware.is_outside and self.arming.pause():
            return self.end() or outcome
        return outcome

    def end(self) -> Outcome | None:
        """End a paused run with all outputs off; None if it never began or is over."""
        outcome = self.executive.end()
        if outcome is not None:
            self.switching_off.forget_settings()
            self._parted(outcome)
        return outcome

    def result(self) -> dict[str, object]:
        """Return how the run ended: the world's truth on doubles, else what the robot knows."""
        return self.hardware.result(self.robot.own_result())

    def outputs(self) -> dict[str, int] | None:
        """Return how many outputs of each chip are on; None where that is unknown."""
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
            self.linked.say_goodbye(outcome, self.task.ending)
        return outcome
