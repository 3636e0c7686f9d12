"""What a page shows: a run under way or its recording, and the statistics that it keeps."""

import os
from pathlib import Path
from typing import Final, NamedTuple

from firmware_runtime.board.registry import Board
from firmware_runtime.board.rigs import has_rig, rig_for
from firmware_runtime.devs.component import below_root
from firmware_runtime.errors import ConfigError, raised_words
from firmware_runtime.executive.clocks import WorldClock
from firmware_runtime.live.observed import Listener, Observed
from firmware_runtime.live.run_state import IN_THE_RUN, RunState, run_state, statistics_at
from firmware_runtime.live.truth import Truth
from firmware_runtime.statistics.paths import Companion
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.system.resources import Closing
from firmware_runtime.system.this_system import IS_LINUX
from firmware_runtime.view.diagram.draw import diagram
from firmware_runtime.view.parts import Diagram, Plane

_MOST_SHOWN: Final = 4
_NICE: Final = 5


class Source(Closing):
    """A recording, and the statistics of its run where they are kept beside it.

    `is_live` follows a run; else all of the recording is read once. `listeners` are called with
    each value that is observed: instant, ns, port, value. Raises ConfigError.
    """

    def __init__(self, recording: Path, statistics: Path | None, *, is_live: bool) -> None:
        self.recording, self.statistics_path, self.is_live = recording, statistics, is_live
        self.listeners: list[Listener] = []
        self.observed = Observed(recording, is_whole=not is_live, listeners=self.listeners)
        self._truth = Truth()
        self.statistics: Statistics | None = None
        self.state: RunState | None = None

    def close(self) -> None:
        """Close the recording."""
        self.observed.close()
        self._truth.close()

    @property
    def board(self) -> Board:
        """The board by the settings of the run."""
        return self.observed.board

    def reopen(self) -> bool:
        """Turn to the run that has begun in the place of this one, if one has."""
        if not self.is_live or not self.observed.is_replaced:
            return False
        try:
            observed = Observed(self.recording, listeners=self.listeners)
        except ConfigError:  # its recording is being made
            return False
        self.observed.close()
        self.observed = observed
        return True

    def observe(self) -> None:
        """Take what is new in the recording, and the truth where its doubles are served."""
        observed, state = self.observed, self.state
        is_running = state is not None and state.state == "running"
        if not observed.poll() or state is None or not is_running:
            return
        served = None if state.doubles == IN_THE_RUN else state.doubles
        for port, value in self._truth.values(served).items():
            observed.note(observed.at, port, value)

    def look(self) -> RunState:
        """Read the statistics, and say how the run fares. Blocks for a moment."""
        kept = statistics_at(self.statistics_path)
        again = self.observed.statistics if kept is None and not self.is_live else None
        self.statistics = kept or again
        self.state = run_state(self.observed, kept, self.statistics_path)
        return self.state

    def model(self) -> dict[str, object]:
        """What does not change while the run goes on: ports, diagram, world, first plots."""
        observed = self.observed
        world = _world_of(self.board)
        return {
            "board": self.board.name,
            "run": self.observed.header.run,
            "is_live": self.is_live,
            "ports": [
                {"path": path, "type": port.type.__name__} for path, port in observed.ports.items()
            ],
            "leaves": sorted(observed.numbers),
            "words": sorted(observed.words),
            "shown": _first(world.shown, observed),
            "plane": world.plane,
            "no_world": world.fault,
            "diagram": Diagram(title="The model", svg=diagram(observed.model)),
        }


def give_way_to(pid: int | None) -> None:
    """Keep this process off the processors of a run that has some of its own, and behind others."""
    os.nice(_NICE)
    if pid is None or not IS_LINUX:
        return
    try:
        others = os.sched_getaffinity(0) - os.sched_getaffinity(pid)
        if others:
            os.sched_setaffinity(0, others)
    except OSError:  # the run is over
        return


def of_run(statistics: Path) -> Source:
    """The run with these statistics. Raises ConfigError where it records nothing."""
    recording = Companion.RECORDING.beside(statistics)
    if not recording.is_file():
        fault = f"no recording of a run beside {statistics}"
        expected = (
            "a run under way, or the last one, with recording.minutes over 0 in its board.toml"
        )
        raise ConfigError.of_one("view", fault, expected=expected)
    return Source(recording, statistics, is_live=True)


class _World(NamedTuple):
    """The port that a board's rig shows, and its world from above; None where it has none."""

    shown: str | None = None
    plane: Plane | None = None
    fault: str = ""
    """Why it cannot be drawn, in a sentence."""


def _world_of(board: Board) -> _World:
    """Return the world of the board's rig; without one, nothing is shown."""
    if not has_rig(board):
        return _World()
    try:
        model = board.unconnected().model
        rig = rig_for(board, WorldClock())
        rig.attach(model)
        port, plane = rig.shown, getattr(rig, "plane", None)
    except Exception as error:  # noqa: BLE001 -- of a rig of anybody's; the rest is shown
        return _World(fault=f"no world is drawn: the rig of {board.name}: {raised_words(error)}")
    shown = None if port is None else below_root(port.path)
    return _World(shown, plane if isinstance(plane, Plane) else None)


def _first(shown: str | None, observed: Observed) -> list[str]:
    """Leaves that are plotted at first: what the board shows, then numbers that models send."""
    numbers = [path for path, port in observed.ports.items() if port.type in {float, int}]
    records = sorted(leaf for leaf in observed.numbers if leaf not in numbers)
    others = [leaf for leaf in records if leaf.rpartition(".")[2] not in {"agrees", "count"}]
    first = [shown, *numbers, *others]
    known = [each for each in first if each in observed.numbers]
    return list(dict.fromkeys(known))[:_MOST_SHOWN]
