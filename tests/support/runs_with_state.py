"""Runs of boards on doubles in virtual time, each with the table of its robot's state."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

from firmware_runtime.board import registry
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.time import seconds
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.recording.blackbox.state.keyframes import StateTable
from firmware_runtime.recording.blackbox.state_of_run import state_of_run
from firmware_runtime.runs.session import Session
from firmware_runtime.runs.start import start_session


class RunWithState:
    """A board's run that pauses where it is told to; its table is made before the first step."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.sent: list[tuple[int, str, object]] = []
        session.executive.hooks.append(self)
        self._table: StateTable | ModelError | None = None

    @property
    def table(self) -> StateTable:
        if isinstance(self._table, ModelError):
            raise self._table
        assert self._table is not None
        return self._table

    def between_steps(self, now: int, left: int) -> None:  # noqa: ARG002 -- a hook's
        if self._table is None:
            session, executive = self.session, self.session.executive
            names = session.board.unconnected().model.components
            atomics = executive.simulator.atomics
            own = frozenset(each for each in atomics if each.path.split(".")[1] in names)
            edges = [
                self,
                session,
                executive,
                session.hardware.rig,
                session.hardware,
                session.board,
            ]
            robot, lines = session.robot, session.hardware.lines
            try:
                self._table = state_of_run(robot, lines, executive.state, own, edges)
            except ModelError as error:
                self._table = error

    def listen(self) -> None:
        """Take down what leaves every model, from now on."""
        for atomic in self.session.executive.simulator.atomics:
            for port in atomic.out_ports.values():
                take = partial(self._take_down, port.path)
                self.session.executive.simulator.listen(port, take)

    def _take_down(self, path: str, now: int, value: object) -> None:
        self.sent.append((now, path, value))

    def to(self, at_s: float) -> bytes:
        """Run on to that instant; the state there."""
        self.session.executive.run_on(seconds(at_s))
        return self.table.capture()


@contextmanager
def run_with_state(board: str, *assignments: str) -> Iterator[RunWithState]:
    session = start_session(
        registry.load(board, assignments), VirtualClock(), doubles=True, statistics_path=None
    )
    try:
        yield RunWithState(session)
    finally:
        session.close()
