"""What an experiment's function works with: the board, the stages chosen, and a way to run both.

    def run(trial: Trial) -> Findings:
        with trial.run(Stage.SIMULATION, for_s=10.0) as ran:
            yaw = ran.points("world.yaw_rad")

Each run is a process of its own, `run BOARD --stage ... --trace ... --record ...`; its recording
stays beside the experiment's other files, its trace goes with the block.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from firmware_runtime.board.assignments import assignments_of
from firmware_runtime.board.experiments import Experiment
from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.board.registry import Board
from firmware_runtime.lab.experiments.running import Setup, Traced, traced
from firmware_runtime.lab.stages.stage import Stage
from firmware_runtime.lab.stages.way import WIFI
from firmware_runtime.links.cut.impairment import Impairment

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Choices:
    """What the command line may choose beside the stage."""

    how: Impairment = WIFI
    """Stage remote's network, each way."""
    is_over_ros: bool = False
    """Whether stage network goes over ROS 2 instead of UDP."""
    peer: str | None = None
    key: Path | None = None
    for_s: float | None = None
    every_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One experiment with one board; `board` has the experiment's settings in it."""

    name: str
    experiment: Experiment
    board: Board
    named: str
    """The board as the command line has it."""
    stages: Sequence[Stage]
    """Those that are to be run, in order."""
    folder: Path
    """Where the experiment's files are gathered; what is put there stays."""
    choices: Choices
    say: Say
    """Shows how far it is, a sentence."""

    def run(  # noqa: PLR0913 -- each may be left out, and has a name
        self,
        stage: Stage,
        *,
        for_s: float,
        inputs: Sequence[str] = (),
        settings: Mapping[str, object] | None = None,
        label: str | None = None,
        is_drawn: bool = False,
    ) -> AbstractContextManager[Traced]:
        """Run the board on doubles; what it sent is there within the block.

        `inputs` are `SECONDS:PORT=VALUE`, as `run --input` has them; `settings` are values of
        board.toml for this run alone. `label` distinguishes the recording from others of this
        experiment, default is the stage. A rig that can draw does so where `is_drawn`, in a stage
        of one process. Raises ConfigError for a run that failed, SystemExit for a signal.
        """
        board = self._board(settings)
        recording = self.folder / f"{self.name}-{label or stage}.recording"
        setup = Setup(
            board=board,
            named=self.named,
            for_s=for_s,
            how=self.choices.how,
            is_over_ros=self.choices.is_over_ros,
            inputs=inputs,
            record=recording,
            is_drawn=is_drawn and not stage.has_two_ends,
        )
        return traced(setup, stage, self.say)

    def run_loop(
        self, stage: Stage, *, for_s: float, every_s: float
    ) -> AbstractContextManager[Traced]:
        """Run a loop in place of the board's model: a value every so often, out and back."""
        setup = Setup(
            board=self.board,
            named=self.named,
            for_s=for_s,
            how=self.choices.how,
            is_over_ros=self.choices.is_over_ros,
            peer=self.choices.peer,
            key=self.choices.key,
            loop_s=every_s,
        )
        return traced(setup, stage, self.say)

    def _board(self, settings: Mapping[str, object] | None) -> Board:
        if not settings:
            return self.board
        return board_in_force(self.named, [*self.board.assignments, *assignments_of(settings)])
