"""Runs of boards on doubles in virtual time, each with the table of its robot's state."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

from firmware_runtime.blackbox.state.keyframes import StateTable
from firmware_runtime.board import registry
from firmware_runtime.devs.time import seconds
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.garbage import GarbageTime
from firmware_runtime.executive.inbox import Inbox
from firmware_runtime.runs.session import Session
from firmware_runtime.statistics.file import StatisticsFile

EDGES = (Executive, VirtualClock, Inbox, StatisticsFile, GarbageTime)


class RunWithState:
    """A board's run that pauses where it is told to; its table is made before the first step.

    With its world, the state of doubles and plant is in the table too.
    """

    def __init__(self, session: Session, *, has_world: bool) -> None:
        self.session = session
        self._has_world = has_world
        self.sent: list[tuple[int, str, object]] = []
        session.executive.hooks.append(self)
        self._table: StateTable | None = None

    @property
    def table(self) -> StateTable:
        assert self._table is not None
        return self._table

    def between_steps(self, now: int, left: int) -> None:  # noqa: ARG002 -- a hook's
        if self._table is None:
            session, executive = self.session, self.session.executive
            edges: list[object] = [*EDGES, executive.cells, self, session, session.board]
            if not self._has_world:
                edges += self._world(session)
            self._table = StateTable({"robot": session.robot, **executive.state}, edges)

    def _world(self, session: Session) -> list[object]:
        rig, simulator = session.rig, session.executive.simulator
        assert rig is not None
        lines = [*rig.buses.values(), *getattr(rig, "ports", {}).values()]
        board, components = session.board, session.robot.model.components
        own = board.unconnected().model.components
        attached = {name: each for name, each in components.items() if name not in own}
        atomics = [each for each in simulator.atomics if each.path.split(".")[1] in attached]
        return [rig, session.world_now, *lines, *attached.values(), *atomics]

    def listen(self) -> None:
        """Take down what leaves every model, from now on."""
        for atomic in self.session.executive.simulator.atomics:
            for port in atomic.out_ports.values():
                take = partial(self._take_down, port.path)
                self.session.executive.simulator.listen(port, take)

    def _take_down(self, path: str, now: int, value: object) -> None:
        self.sent.append((now, path, value))

    def go_on_from(self, at_s: float, state: bytes) -> None:
        """Be in that state, at that instant."""
        self.session.executive.reached = seconds(at_s)
        self.table.restore(state)

    def to(self, at_s: float) -> bytes:
        """Run on to that instant; the state there."""
        self.session.executive.run_on(seconds(at_s))
        return self.table.capture()


@contextmanager
def run_with_state(
    board: str, *assignments: str, has_world: bool = False
) -> Iterator[RunWithState]:
    session = Session(
        registry.load(board, assignments), VirtualClock(), doubles=True, statistics_path=None
    )
    try:
        yield RunWithState(session, has_world=has_world)
    finally:
        session.close()
