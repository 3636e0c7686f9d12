"""Devices that were never ready in a whole run: a run without one of them controlled nothing.

A device is a model that says by `unready` whether it works. From the start of a run those that do
not are looked at between two steps until each has worked once; then nothing is looked at any more.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Protocol, runtime_checkable

from firmware_runtime.devs.engine import Engine
from firmware_runtime.executive.fault_log import FaultLog
from firmware_runtime.executive.outcome import Outcome
from firmware_runtime.executive.step import relative_path
from firmware_runtime.statistics.statistics import RunState


@runtime_checkable
class Device(Protocol):
    """A model of hardware that can say whether it works."""

    path: str

    def unready(self) -> str | None:
        """Why it does not work, in a few words that follow its name; None if it does."""


class Readiness:
    """`waiting` are the devices that have not been ready yet, with their paths."""

    def __init__(self, simulator: Engine, faults: FaultLog) -> None:
        self.waiting = [
            (relative_path(atomic, simulator.root), atomic)
            for atomic in simulator.atomics
            if isinstance(atomic, Device) and atomic.unready() is not None
        ]
        self._faults = faults

    def look(self) -> None:
        """Look at the devices that have not been ready yet."""
        self.waiting = [each for each in self.waiting if each[1].unready() is not None]

    def judged(self, outcome: Outcome) -> Outcome:
        """The outcome of a run that is over: failed, with the cause, if a device was never ready.

        A run that was stopped while devices still came up, none of which reported a fault, has not
        failed; what failed for another reason keeps that.
        """
        self.look()
        reason = "; ".join(self._sentences())
        if self.waiting and outcome.state is RunState.ENDED:
            return replace(outcome, state=RunState.FAILED, reason=reason)
        if self._have_failed() and outcome.state is RunState.STOPPED:
            return replace(outcome, state=RunState.FAILED, reason=f"{reason} ({outcome.reason})")
        return outcome

    def _have_failed(self) -> bool:
        return any(self._faults.last_of(path) is not None for path, _ in self.waiting)

    def _sentences(self) -> Iterator[str]:
        for path, device in self.waiting:
            why, last = device.unready(), self._faults.last_of(path)
            cause = "" if last is None or last.sentence in str(why) else f": {last.sentence}"
            yield f"{path} was never ready: it {why}{cause}"
