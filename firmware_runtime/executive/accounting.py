"""The accounts of all models, and what the policies make of a late loop.

A model with policy `stop` that waits for its turn, or ran, beyond its limit ends the run. After a
step, what ran and what was coalesced is counted; then a periodic model with policy `skip` that is
through with a period, and is booked again before the present instant, is moved on by whole periods.
A model that still waits for its turn is left alone: its late activation runs once, and only then
are further ones dropped.
"""

from collections.abc import Callable, Mapping

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.account import ModelAccount
from firmware_runtime.executive.event_account import EventAccount
from firmware_runtime.executive.periodic_account import PeriodicAccount
from firmware_runtime.executive.policy import SKIP, ActivationPolicy
from firmware_runtime.executive.step import Step
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import Layout

EVENT_TOLERANCE = MILLISECOND
"""Lateness, ns, up to which an event of a model without a period is no overrun."""


class Accounting:
    """Opens an account for every model, and keeps the accounts.

    Raises ConfigError for a model whose period is no time.
    `watch` is called once for each model, in order of declaration. `overrun` says why the run must
    stop; it is empty until a policy demands it.
    """

    def __init__(self, step: Step, policies: Mapping[str, ActivationPolicy]) -> None:
        self.accounts: list[ModelAccount] = []
        self.periodic: list[PeriodicAccount] = []
        self.overrun = ""
        self._step = step
        self._policies = policies
        self._touched: list[ModelAccount] = []
        self._stopping: list[ModelAccount] = []
        self._postpone: Callable[[Atomic, int], None]

    def watch(self, atomic: Atomic, path: str, functions: Functions) -> Functions:
        """Open the account of a model; return its functions, watched."""
        number = len(self.accounts)
        if type(atomic.period) is not int or atomic.period <= 0:
            fault = (
                f"period of {path} is {atomic.period!r}; expected whole ns, more than 0, or NEVER"
            )
            raise ConfigError(path, [fault])
        account: ModelAccount
        if atomic.period == NEVER:
            account = EventAccount(atomic, path, number, SKIP, EVENT_TOLERANCE)
        else:
            policy = self._policies.get(path, SKIP)
            account = PeriodicAccount(atomic, path, number, policy)
            self.periodic.append(account)
        self.accounts.append(account)
        return account.watch(functions, self._step, self._touched)

    def attach(self, simulator: Engine) -> list[str]:
        """Take over the first deadlines; return policies that nothing falls under, as faults."""
        self._postpone = simulator.postpone
        for account in self.accounts:
            account.begin(simulator.due_at(account.atomic))
        self._stopping = [each for each in self.accounts if each.stop_after != NEVER]
        unknown = self._policies.keys() - {account.path for account in self.periodic}
        return [f"policy of {path}: no periodic model has this path" for path in sorted(unknown)]

    def count_in(self, cells: Cells, layout: Layout) -> None:
        """From now on, count in the statistics file."""
        for index, account in enumerate(self.accounts):
            account.count_in(cells, layout, index)

    @property
    def tolerance(self) -> int:
        """The least lateness that is an overrun of some periodic model; 1 ms if there is none."""
        return min((account.tolerance for account in self.periodic), default=MILLISECOND)

    @property
    def has_limits(self) -> bool:
        """Whether some model has the policy `stop`."""
        return bool(self._stopping)

    def is_overdue(self, now: int) -> bool:
        """Whether a model with policy `stop` waits for its turn beyond its limit."""
        for account in self._stopping:
            if now - account.due > account.stop_after:
                self._stop(account, now - account.due)
                return True
        return False

    def settle(self, now: int) -> ModelAccount | None:
        """Count a step's activations, skip what is due before `now` where that is the policy.

        Returns the account of the activation that ran latest, if any ran.
        """
        step = self._step
        at, own_times = step.at, step.own_times
        latest, has_limits = None, self.has_limits
        for account in self._touched:
            if account.settle(at, own_times[account.number]):
                if has_limits and account.lateness > account.stop_after:
                    self._stop(account, account.lateness)
                if latest is None or account.lateness > latest.lateness:
                    latest = account
            if account.booked < now and account.is_to_skip(step):
                self._postpone(account.atomic, account.skip_to(now))
        self._touched.clear()
        return latest

    def totals(self) -> tuple[int, int, int, int]:
        """What all models have run, overrun and skipped, and the sum of their lateness, ns."""
        accounts = self.accounts
        return (
            sum(account.run for account in accounts),
            sum(account.overruns for account in accounts),
            sum(account.skipped for account in accounts),
            sum(account.late_by.sum for account in accounts),
        )

    def end(self, now: int) -> None:
        """Count what is due at `now` as skipped: the run is over."""
        for account in self.accounts:
            account.end(now)

    def _stop(self, account: ModelAccount, late: int) -> None:
        self.overrun = (
            f"{account.path}: an activation was {late / MICROSECOND:.0f} us late; "
            f"its policy stops the run over {account.stop_after / MICROSECOND:.0f} us"
        )
