"""Everything that watches a run: an account of every model, settled after each step.

In a step only the simulator's laps are noted (`step`), from which the accounts see what was called,
how long it took and what it has booked; what leaves a model is listened to (`fault_log`,
`deadlines`); the lines have counters of their own.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.account import ModelAccount, Step
from firmware_runtime.executive.accounting import Accounting, DeadlineWatch
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.fault_log import FaultLog
from firmware_runtime.executive.garbage import GarbageTime
from firmware_runtime.executive.periodic_account import PeriodicAccount
from firmware_runtime.statistics.blame import BLAME, CAUSES
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.layout import Layout


class Profiler:
    """A simulator whose models are watched, and what watches them.

    Of a clock it is said whether it `stands_still` during a step, as virtual time does.
    Raises ConfigError, listing all policies and deadlines that name nothing in the model.
    """

    def __init__(
        self,
        root: Component,
        now: Callable[[], int],
        configuration: Configuration,
        *,
        stands_still: bool = False,
    ) -> None:
        tap = configuration.tap
        self.step = Step(now, stands_still=stands_still)
        self.simulator = Simulator(
            root,
            checked=None if stands_still else False,
            instruments=() if tap is None else (tap.instrument,),
            laps=self.step.laps,
        )
        self.accounting = Accounting(self.step, self.simulator, configuration.policies)
        self._refuse_what_names_nothing(configuration)
        self.watches = self.accounting.watches = [
            DeadlineWatch(deadline, self.simulator, self.step.laps.noted)
            for deadline in configuration.deadlines
        ]
        for watch in self.watches:
            account = self.accounting.accounts[
                self.simulator.atomics.index(watch.deadline.to_model)
            ]
            account.answers, account.is_plain = (*account.answers, watch), False
        self.garbage = GarbageTime(now)
        self.faults = FaultLog(self.simulator)
        self.buses, self.ports = configuration.buses, configuration.ports
        self._worst = configuration.worst
        self._has_link = configuration.has_link
        if tap is not None:
            tap.watch(self.step)

    @property
    def state(self) -> dict[str, object]:
        """What it consists of, by name."""
        names = ("simulator", "step", "accounting", "faults", "watches", "buses")
        return {name: getattr(self, name) for name in names}

    def open_file(self, header: Mapping[str, object], path: Path | None) -> StatisticsFile:
        """A statistics file at `path`, or in memory; the models join the header.

        Raises StatisticsFileError.
        """
        models = {account.path: _stated(account) for account in self.accounting.accounts}
        return StatisticsFile(self._layout(), {"models": models, **header}, path)

    def _layout(self) -> Layout:
        """What the statistics file needs room for."""
        return Layout(
            models=tuple(self.step.paths),
            timed=tuple(self.step.paths),
            buses=tuple(bus.name for bus in self.buses),
            ports=tuple(port.name for port in self.ports),
            deadlines=tuple(watch.deadline.name for watch in self.watches),
            fault_models=self.faults.models,
            worst=self._worst,
            has_link=self._has_link,
            blame=BLAME,
            causes=CAUSES,
        )

    def _refuse_what_names_nothing(self, configuration: Configuration) -> None:
        faults = self.accounting.unknown(configuration.policies)
        for deadline in configuration.deadlines:
            faults += deadline.missing_from(self.simulator.atomics)
        if faults:
            raise ConfigError(self.simulator.root.name, faults)


def _stated(account: ModelAccount) -> dict[str, object]:
    is_periodic = isinstance(account, PeriodicAccount)
    return {
        "kind": account.kind,
        "period_ns": account.period if is_periodic else None,
        "tolerance_ns": account.tolerance,
        "policy": account.policy.policy if is_periodic else None,
    }
