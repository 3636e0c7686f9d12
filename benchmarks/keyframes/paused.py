"""A board's run on doubles in virtual time that can be paused and captured."""

from time import thread_time_ns

from firmware_runtime.blackbox.state.keyframes import StateTable
from firmware_runtime.blackbox.state_of_run import state_of_run
from firmware_runtime.board import registry
from firmware_runtime.closing import Closing
from firmware_runtime.devs.time import seconds
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.layout import STEPS


class PausedRun(Closing):
    """Its table is made before the first step, as in a run that is recorded."""

    def __init__(self, board: str, *assignments: str) -> None:
        loaded = registry.load(board, assignments)
        self._session = start_session(loaded, VirtualClock(), doubles=True, statistics_path=None)
        self._session.executive.hooks.append(self)
        self._table: StateTable | None = None

    @property
    def table(self) -> StateTable:
        """Of the robot and its executive, without the doubles and their world."""
        if self._table is None:
            raise RuntimeError("the run has not begun")
        return self._table

    def between_steps(self, now: int, left: int) -> None:  # noqa: ARG002 -- a hook's
        """Make the table, once."""
        if self._table is not None:
            return
        session, board, executive = self._session, self._session.board, self._session.executive
        names = board.unconnected().model.components
        atomics = executive.simulator.atomics
        own = frozenset(each for each in atomics if each.path.split(".")[1] in names)
        edges = [self, session, executive, session.rig, session.hardware, board]
        lines = session.hardware.lines
        self._table = state_of_run(session.robot, lines, executive.state, own, edges)

    def go_on(self, until_s: float) -> float:
        """Run on to that instant; CPU time of a step, us."""
        begin = thread_time_ns()
        self._session.executive.run_on(seconds(until_s))
        spent = thread_time_ns() - begin
        return spent / 1e3 / int(self._session.executive.cells[STEPS])

    def close(self) -> None:
        """Close its session."""
        self._session.close()
