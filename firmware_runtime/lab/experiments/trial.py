"""The argument of an experiment's function: the board, the stages chosen, and a way to run both.

    def run(trial: Trial) -> Findings:
        with trial.run(Stage.SIMULATION, for_s=10.0) as ran:
            yaw = ran.points("world.yaw_rad")

Each run is a process of its own, `run BOARD --stage ... --trace ... --record ...`; its recording
stays beside the experiment's other files, its trace goes with the block.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from time import monotonic_ns
from typing import Any, TypeAlias

from firmware_runtime.board.assignments import assignments_of
from firmware_runtime.board.experiments import Experiment
from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.board.registry import Board
from firmware_runtime.board.roles import CONTROLLER, Stage
from firmware_runtime.devs.senders import Senders
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.lab.stages.staged_run import Staged, run_to_end
from firmware_runtime.system.own_folder import own_folder
from firmware_runtime.view.page_file import read_page
from firmware_runtime.view.parts import Page

Say = Callable[[str], None]
Points: TypeAlias = list[tuple[float, float]]
"""Seconds, and a value; in order."""


@dataclass(frozen=True, slots=True)
class Traced:
    """A run that ended as it should have: its document, and its trace by time of origin."""

    document: dict[str, Any]
    trace: Path
    shown: str | None
    """The port whose values a person wants to see over time."""
    senders: Senders
    """The ports that send what leaves a coupled model's."""
    picture: Page | None = None
    """The run as the rig draws it; None where that was not asked for."""

    @property
    def began_s(self) -> float:
        """Start of the controller's run, s, on the time scale of the trace."""
        begins: dict[str, int] = self.document["statistics"].get("begins_ns", {})
        return begins.get(CONTROLLER, 0) / SECOND

    @property
    def between(self) -> str:
        """Link between the ends of the run, in words."""
        link = self.document["link"]
        if link is None:
            return f"one process, {self.document['clock']} time"
        words = f"{link['over']}, between {link['between']}"
        if (impaired := link["impairment"]) is None:
            return words
        return f"{words}, {impaired['how']} each way by {impaired['by']}"

    def points(self, port: str, *keys: str | int) -> Points:
        """Values that left a port: seconds since the controller began, and the value.

        `keys` lead to a number in it, such as `"rate"`, or `"field", 0`. Values before the
        controller began, in a stage of two ends, have negative instants.
        """
        began_s, found = self.began_s, []
        for message in self.messages(port):
            value = message["value"]
            for key in keys:
                value = value[key]
            found.append((message["t_ns"] / SECOND - began_s, float(value)))
        return found

    def messages(self, *ports: str) -> Iterator[dict[str, Any]]:
        """The lines of the trace that are of these ports, or of those that send through them."""
        senders = [sent for port in ports for sent in self.senders.of(port)]
        with self.trace.open() as file:
            for line in file:
                message = json.loads(line)
                if message["port"] in senders:
                    yield message


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One experiment with one board, which has the experiment's settings in it."""

    name: str
    experiment: Experiment
    plan: Staged
    """Settings of its runs; `for_s` and `loop_s` where the command line has them, for a loop."""
    stages: Sequence[Stage]
    """Those that are to be run, in order."""
    folder: Path
    """Folder of the experiment's files; what is put there stays."""
    say: Say
    """Shows how far it is, a sentence."""

    @property
    def board(self) -> Board:
        """Return the board."""
        return self.plan.board

    @contextmanager
    def run(  # noqa: PLR0913 -- each may be left out, and has a name
        self,
        stage: Stage,
        *,
        for_s: float,
        inputs: Sequence[str] = (),
        settings: Mapping[str, object] | None = None,
        label: str | None = None,
        is_drawn: bool = False,
        loop_s: float | None = None,
    ) -> Iterator[Traced]:
        """Run the board on doubles; its trace is there within the block.

        `inputs` are `SECONDS:PORT=VALUE`, as `run --input` has them; `settings` are values of
        board.toml for this run alone. `label` distinguishes the recording from others of this
        experiment, default is the stage. A rig that can draw does so where `is_drawn`, in a stage
        of one process. `loop_s` runs a loop in place of the board's model, unrecorded: a value
        every so often, out and back. Raises ConfigError for a run that failed, SystemExit for a
        signal.
        """
        board, named = self.board, label or stage
        if settings:
            assignments = [*board.assignments, *assignments_of(settings)]
            board = board_in_force(self.plan.named, assignments)
        with own_folder() as folder:
            staged = replace(
                self.plan,
                board=board,
                stage=stage,
                for_s=for_s,
                inputs=inputs,
                trace=(trace := folder / "trace.jsonl"),
                record=None if loop_s else self.folder / f"{self.name}-{named}.recording",
                loop_s=loop_s,
                called_at=monotonic_ns(),
            )
            may_draw = is_drawn and not stage.has_two_ends
            yield self._traced(staged, trace, trace.with_suffix(".json") if may_draw else None)

    def _traced(self, staged: Staged, trace: Path, picture: Path | None) -> Traced:
        result = run_to_end(staged, self.say, picture)
        if result.status != Status.OK:
            fault = f"the run did not reach its end: {result.reason}"
            raise ConfigError.of_one(f"stage {staged.stage}", fault)
        senders = Senders(staged.board.unconnected().model)
        drawn = None if picture is None else read_page(picture)
        return Traced(result.document, trace, result.shown, senders, drawn)
