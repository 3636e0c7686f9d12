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
from firmware_runtime.devs.functions import OUTPUT
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, whole
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.account import EventAccount, ModelAccount, count_events
from firmware_runtime.executive.deadlines import READS_INPUT, DeadlineWatch
from firmware_runtime.executive.fault_log import FaultLog
from firmware_runtime.executive.periodic_account import PeriodicAccount
from firmware_runtime.executive.policy import SKIP, ActivationPolicy
from firmware_runtime.executive.step import Step
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import Layout

EVENT_TOLERANCE = MILLISECOND
"""Lateness, ns, up to which an event of a model without a period is no overrun."""


def open_account(
    atomic: Atomic, step: Step, policies: Mapping[str, ActivationPolicy]
) -> ModelAccount:
    """The account of a model. Raises ConfigError for a period that is none."""
    path = below_root(atomic.path)
    if type(atomic.period) is not int or atomic.period <= 0:
        fault = f"period of {path} is {atomic.period!r}; expected whole ns, more than 0, or NEVER"
        raise ConfigError(path, [fault])
    if atomic.period == NEVER:
        return EventAccount(atomic, step, SKIP, EVENT_TOLERANCE)
    return PeriodicAccount(atomic, step, policies.get(path, SKIP))


class Accounting:
    """Keeps the accounts of all models of a simulator, in order of declaration.

    `overrun` says why the run must stop; it is empty until a policy demands it.
    """

    def __init__(
        self, step: Step, simulator: Simulator, policies: Mapping[str, ActivationPolicy]
    ) -> None:
        self.accounts: list[ModelAccount] = [
            open_account(atomic, step, policies) for atomic in simulator.atomics
        ]
        self.periodic = [each for each in self.accounts if isinstance(each, PeriodicAccount)]
        self.watches: Sequence[DeadlineWatch] = ()
        self.overrun = ""
        self._step = step
        self._stopping = [each for each in self.accounts if each.stop_after != NEVER]
        self.has_limits = bool(self._stopping)
        """Whether some model has the policy `stop`."""
        self._postpone = simulator.postpone
        for account in self.accounts:
            account.begin(simulator.due_at(account.atomic))

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

    def settle(self, now: int, samples: list[object]) -> ModelAccount | None:
        """Count a step's activations, skip what is due before `now` where that is the policy.

        Returns the account of the activation that ran latest, if any ran. `samples` gets histograms
        and what is to be recorded in them, in turns.
        """
        step, latest = self._step, None
        touched = self._follow()
        count_events(touched, step, samples)
        for account in touched:
            if isinstance(account, PeriodicAccount):
                account.count(step, samples)
            if account.has_run:
                account.has_run = False
                if self.has_limits and account.lateness > account.stop_after:
                    self._stop(account, account.lateness)
                if latest is None or account.lateness > latest.lateness:
                    latest = account
            if (
                isinstance(account, PeriodicAccount)
                and account.booked < now
                and account.is_to_skip()
            ):
                self._postpone(account.atomic, account.skip_to(now))
        return latest

    def _follow(self) -> list[ModelAccount]:
        """See what the step's transitions were; return the accounts of models that had any.

        Of a model without a period that was not due, nothing counts but what it has booked last.
        """
        step, accounts, touched = self._step, self.accounts, list[ModelAccount]()
        noted = step.laps.noted
        numbers = noted[0::4]
        if not step.stands_still:
            self._divide(numbers)
        for number, last in dict(zip(numbers, range(0, len(noted), 4), strict=True)).items():
            account, sigma = accounts[number], noted[last + 3]
            if (
                account.is_plain
                and account.due > step.ended
                and account.put_off == NEVER
                and noted[last + 1] != OUTPUT
                and type(sigma) is int
            ):
                account.due = step.at + sigma if 0 < sigma < NEVER else NEVER
                touched.append(account)
            elif self._follow_one(account, numbers):
                touched.append(account)
        for watch in self.watches:
            if watch.left:
                watch.count_samples(step, len(noted))
        return touched

    def _follow_one(self, account: ModelAccount, numbers: list[int]) -> bool:
        """Go through the transitions of one model; return whether there were any."""
        step, number, has_any = self._step, account.number, False
        noted, epoch, began_at = step.laps.noted, step.epoch, step.started
        for index, each in enumerate(numbers):
            if each != number:
                continue
            place = 4 * index
            function, reading, sigma = noted[place + 1 : place + 4]
            begun = noted[place - 2] - epoch if index else step.started
            if function == OUTPUT:
                began_at = begun
                continue
            has_any = True
            if type(sigma) is not int:  # one of numpy's, or one that ends the run
                sigma = whole(sigma) or 0  # what the simulator makes of it
            account.follow(function, step.at, begun, reading - epoch, began_at, sigma)
            if function in READS_INPUT:
                for watch in account.answers:
                    watch.answer(step, place, reading - epoch)
        return has_any

    def _divide(self, numbers: list[int]) -> None:
        """Divide the step's time among the models."""
        step = self._step
        noted, epoch, ended = step.laps.noted, step.epoch, step.started
        own_times, began_at = step.own_times, step.began_at
        for number, function, reading in zip(numbers, noted[1::4], noted[2::4], strict=True):
            begun, ended = ended, reading - epoch
            own_times[number] += ended - begun
            if function == OUTPUT:
                began_at[number] = begun

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
