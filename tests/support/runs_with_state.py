"""Runs of boards on doubles in virtual time, each with the table of its robot's state."""

from collections.abc import Iterator
from contextlib import contextmanager

from firmware_runtime.blackbox.keyframes import StateTable
from firmware_runtime.blackbox.robot_state import robot_state, world_models
from firmware_runtime.board import registry
from firmware_runtime.devs.time import seconds
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.runs.session import Session


class RunWithState:
    """A board's run that pauses where it is told to; its table is made before the first step."""

    def __init__(self, session: Session) -> None:
        self.session = session
        session.executive.hooks.append(self)
        self._table: StateTable | None = None

    @property
    def table(self) -> StateTable:
        assert self._table is not None
        return self._table

    def between_steps(self, now: int, left: int) -> None:  # noqa: ARG002 -- a hook's
        if self._table is None:
            session, executive = self.session, self.session.executive
            rig = session.rig
            assert rig is not None
            world = world_models(session.board, session.robot.model, executive.simulator)
            edges = [session, rig, session.board, session.world_now, *world]
            edges += [*rig.buses.values(), *getattr(rig, "ports", {}).values()]
            self._table = robot_state(session.robot, executive, edges)

    def to(self, at_s: float) -> bytes:
        """Run on to that instant; the state there."""
        self.session.executive.run_on(seconds(at_s))
        return self.table.capture()


@contextmanager
def run_with_state(board: str, *assignments: str) -> Iterator[RunWithState]:
    session = Session(
        registry.load(board, assignments), VirtualClock(), doubles=True, statistics_path=None
    )
    try:
        yield RunWithState(session)
    finally:
        session.close()
