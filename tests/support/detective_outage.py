"""Missions of the detective robot, as a run on doubles in virtual time, with a bus that fails."""

from typing import NamedTuple

from firmware_runtime.board import registry
from firmware_runtime.board.robot import Ending
from firmware_runtime.devs.time import seconds
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.runs.start import start_session
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.i2c_bus import I2cBusDouble

LONGEST_S = 240.0


class Mission(NamedTuple):
    """How a run ended: its outcome, the mission's own word, and outputs that are still on."""

    outcome: Outcome
    ending: Ending | None
    outputs_on: int

    @property
    def is_safe(self) -> bool:
        """Whether every output is off, and the run says so."""
        return self.outcome.faults == () and self.outputs_on == 0


def mission_with_outage(begins_s: float, lasts_s: float, *assignments: str) -> Mission:
    """Run a mission during which no chip answers for a while."""
    board = registry.load("detective", assignments)
    session = start_session(board, VirtualClock(), doubles=True, statistics_path=None)
    try:
        assert session.hardware.rig is not None
        since, until = seconds(begins_s), seconds(begins_s + lasts_s)
        outage = NackAddress(since=since, until=until, times=None)
        for bus in session.hardware.rig.buses.values():
            assert isinstance(bus, I2cBusDouble)
            bus.faults = FaultScript([outage])
        outcome = session.executive.run(seconds(LONGEST_S))
        outputs = session.outputs() or {}
        return Mission(outcome, session.task.ending, sum(outputs.values()))
    finally:
        session.close()
