"""Everything that watches a run: what the simulator calls on the way, and what reads it after.

Only together they are an instrument. Each part wraps what the part before it has wrapped and builds
on it: the flight recorder and the accounts read the laps that `step` takes.
"""

from collections.abc import Callable

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.functions import Functions
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.account import ModelAccount
from firmware_runtime.executive.accounting import Accounting
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.deadlines import DeadlineWatch
from firmware_runtime.executive.fault_log import FaultLog
from firmware_runtime.executive.garbage import GarbageTime
from firmware_runtime.executive.periodic_account import PeriodicAccount
from firmware_runtime.executive.recorder import Recorder
from firmware_runtime.executive.step import Step
from firmware_runtime.statistics.layout import Layout


class Instruments:
    """The one instrument of a run; `Simulator(root, instruments=[instruments])`."""

    def __init__(
        self, root: Component, now: Callable[[], int], configuration: Configuration
    ) -> None:
        self.step = Step(root, now)
        self.accounting = Accounting(self.step, configuration.policies)
        self.watches = [DeadlineWatch(each, now) for each in configuration.deadlines]
        rows = configuration.recorded_spans
        self.recorder = Recorder(self.step, rows) if rows > 0 else None
        tell = None if self.recorder is None else self.recorder.garbage_collected
        self.garbage = GarbageTime(now, tell)
        self.faults = FaultLog()
        self.buses = configuration.buses
        self._worst = configuration.worst

    def __call__(self, atomic: Atomic, functions: Functions) -> Functions:
        """Wrap one model's functions; the parts from the innermost outwards."""
        functions = self.step.watch(atomic, functions)
        number = len(self.step.paths) - 1
        if self.recorder is not None:
            functions = self.recorder.watch(number, functions)
        for watch in self.watches:
            functions = watch.watch(atomic, functions)
        return self.accounting.watch(atomic, self.step.paths[number], functions)

    def attach(self, simulator: Engine) -> None:
        """Take up what only the finished simulator knows.

        Raises ConfigError, listing all policies and deadlines that name nothing in the model.
        """
        self.faults.attach(simulator)
        faults = [*self.accounting.attach(simulator)]
        for watch in self.watches:
            faults.extend(watch.attach(simulator))
        if faults:
            raise ConfigError(simulator.root.name, faults)

    def layout(self) -> Layout:
        """What the statistics file needs room for."""
        return Layout(
            models=tuple(account.path for account in self.accounting.accounts),
            timed=tuple(self.step.paths),
            buses=tuple(bus.name for bus in self.buses),
            deadlines=tuple(watch.deadline.name for watch in self.watches),
            fault_models=self.faults.models,
            worst=self._worst,
        )

    def models(self) -> dict[str, dict[str, object]]:
        """What is stated of each model, for the header of the statistics file."""
        accounts = self.accounting.accounts
        return {account.path: _stated(account) for account in accounts}


def _stated(account: ModelAccount) -> dict[str, object]:
    is_periodic = isinstance(account, PeriodicAccount)
    return {
        "kind": account.kind,
        "period_ns": account.period if is_periodic else None,
        "tolerance_ns": account.tolerance,
        "policy": account.policy.policy if is_periodic else None,
    }
