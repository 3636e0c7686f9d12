"""Everything that watches a run, one instrument: an account in the place of every model.

The accounts time the models' functions and see what they book (`account`); what leaves
a model is listened to (`fault_log`, `deadlines`); the lines have counters of their own.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.account import ModelAccount
from firmware_runtime.executive.accounting import Accounting, open_account
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.deadlines import DeadlineWatch, PathDeadline
from firmware_runtime.executive.fault_log import FaultLog
from firmware_runtime.executive.garbage import GarbageTime
from firmware_runtime.executive.periodic_account import PeriodicAccount
from firmware_runtime.executive.step import Step
from firmware_runtime.executive.untimed_account import UntimedEventAccount, answering
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
        is_kept = configuration.statistics_path is not None
        reading = now if tap is None else tap.reading(now)
        self.step = Step(reading, takes_time=is_kept or not stands_still)
        self._policies = configuration.policies
        self._accounts: list[ModelAccount] = []
        self._actuators = {deadline.to_model for deadline in configuration.deadlines}
        instruments = [self._open_account] if tap is None else [tap.instrument, self._open_account]
        checked = None if stands_still else False
        self.simulator = Simulator(root, checked=checked, instruments=instruments)
        self.accounting = Accounting(self.step, self._accounts, self.simulator)
        self._refuse_what_names_nothing(configuration)
        self.watches = [self._watch(each) for each in configuration.deadlines]
        self.garbage = GarbageTime(now)
        self.faults = FaultLog(self.simulator)
        self.buses, self.ports = configuration.buses, configuration.ports
        self._worst = configuration.worst
        self._has_link = configuration.has_link

    @property
    def state(self) -> dict[str, object]:
        """What it consists of, by name."""
        names = ("simulator", "step", "accounting", "faults", "watches", "buses")
        return {name: getattr(self, name) for name in names}

    def open_file(self, header: Mapping[str, Any], path: Path | None) -> StatisticsFile:
        """A statistics file at `path`, or in memory; the models join the header.

        Raises StatisticsFileError.
        """
        models = {account.path: _stated(account) for account in self._accounts}
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

    def _open_account(self, atomic: Atomic, functions: Functions) -> Functions:
        """What the simulator calls for a model: its account, unless that counts from outside."""
        account = open_account(atomic, functions, self.step, self._policies)
        self._accounts.append(account)
        if isinstance(account, UntimedEventAccount):
            return answering(functions, account) if atomic in self._actuators else functions
        return account

    def _refuse_what_names_nothing(self, configuration: Configuration) -> None:
        faults = self.accounting.unknown(configuration.policies)
        for deadline in configuration.deadlines:
            faults += deadline.missing_from(self.simulator.atomics)
        if faults:
            raise ConfigError(self.simulator.root.name, faults)

    def _watch(self, deadline: PathDeadline) -> DeadlineWatch:
        """Have a deadline's answers counted by the account of its actuator."""
        watch = DeadlineWatch(deadline, self.step.now, self.simulator)
        account = self._accounts[self.simulator.atomics.index(deadline.to_model)]
        account.answers = (*account.answers, watch.answer)
        return watch


def _stated(account: ModelAccount) -> dict[str, object]:
    is_periodic = isinstance(account, PeriodicAccount)
    return {
        "kind": account.kind,
        "period_ns": account.period if is_periodic else None,
        "tolerance_ns": account.tolerance,
        "policy": account.policy.policy if is_periodic else None,
    }
