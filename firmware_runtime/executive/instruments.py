"""Everything that watches a run: what the simulator calls on the way, and what reads it after."""

from collections.abc import Callable

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.functions import Instrument
from firmware_runtime.errors import BoardError
from firmware_runtime.executive.accounting import Accounting
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.deadlines import DeadlineWatch
from firmware_runtime.executive.fault_log import FaultLog
from firmware_runtime.executive.garbage import GarbageTime
from firmware_runtime.executive.recorder import Recorder
from firmware_runtime.executive.step import Step
from firmware_runtime.telemetry.layout import Layout


class Instruments:
    """The instruments of one run."""

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

    @property
    def for_simulator(self) -> list[Instrument]:
        """In the order in which they wrap a model's functions, innermost first."""
        recorders = [] if self.recorder is None else [self.recorder]
        return [self.step, *recorders, *self.watches, self.accounting]

    def attach(self, simulator: Engine) -> None:
        """Take up what only the finished simulator knows.

        Raises BoardError, listing all policies and deadlines that name nothing in the model.
        """
        self.faults.attach(simulator)
        faults = [*self.accounting.attach(simulator)]
        for watch in self.watches:
            faults.extend(watch.attach(simulator))
        if faults:
            raise BoardError(simulator.root.name, faults)

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
        """What is stated of each periodic model, for the header of the statistics file."""
        return {
            account.path: {
                "period_ns": account.period,
                "tolerance_ns": account.tolerance,
                "policy": account.policy.policy,
            }
            for account in self.accounting.accounts
        }
