"""The accounts of all models, and what the policies make of a late loop.

A model with policy `stop` that waits for its turn, or ran, beyond its limit ends the run. After a
step, what ran and what was coalesced is counted; then a periodic model with policy `skip` that is
through with a period, and is booked again before the present instant, is moved on by whole periods.
A model that still waits for its turn is left alone: its late activation runs once, and only then
are further ones dropped.
"""

from collections.abc import Iterable, Mapping, Sequence

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.account import ModelAccount
from firmware_runtime.executive.event_account import EventAccount
from firmware_runtime.executive.fault_log import FaultLog
from firmware_runtime.executive.periodic_account import PeriodicAccount
from firmware_runtime.executive.policy import SKIP, ActivationPolicy
from firmware_runtime.executive.step import Step
from firmware_runtime.executive.untimed_account import UntimedEventAccount
from firmware_runtime.executive.untimed_periodic_account import UntimedPeriodicAccount
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import Layout

EVENT_TOLERANCE = MILLISECOND
"""Lateness, ns, up to which an event of a model without a period is no overrun."""


def open_account(
    atomic: Atomic, functions: Functions, step: Step, policies: Mapping[str, ActivationPolicy]
) -> ModelAccount:
    """The account that stands in a model's place. Raises ConfigError for a period that is none."""
    path = below_root(atomic.path)
    if type(atomic.period) is not int or atomic.period <= 0:
        fault = f"period of {path} is {atomic.period!r}; expected whole ns, more than 0, or NEVER"
        raise ConfigError(path, [fault])
    if atomic.period == NEVER:
        kind = EventAccount if step.takes_time else UntimedEventAccount
        return kind(atomic, functions, step, SKIP, EVENT_TOLERANCE)
    periodic = PeriodicAccount if step.takes_time else UntimedPeriodicAccount
    return periodic(atomic, functions, step, policies.get(path, SKIP))


class Accounting:
    """Keeps the accounts of all models of a simulator, in order of declaration.

    `overrun` says why the run must stop; it is empty until a policy demands it.
    """

    def __init__(self, step: Step, accounts: Sequence[ModelAccount], simulator: Simulator) -> None:
        self.accounts = accounts
        self.periodic = [each for each in accounts if isinstance(each, PeriodicAccount)]
        self.overrun = ""
        self._step = step
        self._stopping = [each for each in accounts if each.stop_after != NEVER]
        self.has_limits = bool(self._stopping)
        """Whether some model has the policy `stop`."""
        self._postpone = simulator.postpone
        for account in accounts:
            account.begin(simulator.due_at(account.atomic))
        self._untimed = [
            account if isinstance(account, UntimedEventAccount) else None for account in accounts
        ]
        self._last_at, self._booked_at = simulator.last_at, simulator.booked_at
        self._involved: set[int] = set()
        if not step.takes_time:
            simulator.involved = self._involved

    def state(self) -> dict[str, str]:
        """Why the run must stop, if it must; each account has its own state."""
        return {"overrun": self.overrun}

    def restore(self, state: dict[str, str]) -> None:
        """Have found that."""
        self.overrun = str(state["overrun"])

    def unknown(self, policies: Mapping[str, ActivationPolicy]) -> list[str]:
        """Policies that no model falls under, as faults."""
        paths = sorted(policies.keys() - {account.path for account in self.periodic})
        return [f"policy of {path}: no periodic model has this path" for path in paths]

    def count_in(self, cells: Cells, layout: Layout) -> None:
        """From now on, count in the statistics file."""
        for account in self.accounts:
            account.count_in(cells, layout)

    @property
    def tolerance(self) -> int:
        """The least lateness that is an overrun of some periodic model; 1 ms if there is none."""
        return min((account.tolerance for account in self.periodic), default=MILLISECOND)

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
        step, accounts = self._step, self.accounts
        at, own_times = step.at, step.own_times
        latest, has_limits = None, self.has_limits
        for number in step.touched:
            account = accounts[number]
            if account.settle(at, own_times[number]):
                if has_limits and account.lateness > account.stop_after:
                    self._stop(account, account.lateness)
                if latest is None or account.lateness > latest.lateness:
                    latest = account
            if account.booked < now and account.is_to_skip():
                self._postpone(account.atomic, account.skip_to(now))
        step.touched.clear()
        return latest

    def settle_untimed(self) -> None:
        """Count a step's activations where it took no time: none is late, and none to be skipped.

        What only counts in itself is in the file after `copy_into`.
        """
        step, untimed = self._step, self._untimed
        at, last_at, booked_at = step.at, self._last_at, self._booked_at
        for number in self._involved:
            account = untimed[number]
            # of models whose transition has not been completed the step has failed
            if account is not None and last_at[number] == at:
                if account.due == at:
                    account.run += 1
                else:
                    account.reactions += 1
                account.due = booked_at[number]
        self._involved.clear()
        for number in step.touched:
            self.accounts[number].settle(at, 0)
        step.touched.clear()

    def copy_into(self, cells: Cells, layout: Layout) -> None:
        """Write the blocks of the models whose accounts count in themselves."""
        for account in self.accounts:
            if isinstance(account, UntimedEventAccount | UntimedPeriodicAccount):
                account.copy_into(cells, layout)

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


def counts_of(accounts: Iterable[ModelAccount], faults: FaultLog) -> dict[str, dict[str, int]]:
    """What became of each model's activations so far, and its faults by kind, by path."""
    counts = {
        account.path: {
            "run": account.run,
            "skipped": account.skipped,
            "coalesced": account.coalesced,
            "overruns": account.overruns,
        }
        for account in accounts
    }
    for fault in faults.counted:
        counts[fault.path][f"fault {fault.kind}"] = fault.count
    return counts
