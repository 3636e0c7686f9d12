"""The accounts of all models and deadlines, and what the policies make of a late loop.

A model with policy `stop` that waits for its turn, or ran, beyond its limit ends the run. After a
step, what ran and what was coalesced is counted; then a periodic model with policy `skip` that is
through with a period, and is booked again before the present instant, is moved on by whole periods.
A model that still waits for its turn is left alone: its late activation runs once, and only then
are further ones dropped.
"""

from collections.abc import Iterable, Mapping, Sequence

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.functions import CONFLUENT, EXTERNAL, EXTERNAL_OF_BOTH, OUTPUT
from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.time import MICROSECOND, MILLISECOND, NEVER, kept, whole
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.account import (
    REACTIONS,
    EventAccount,
    ModelAccount,
    Step,
    count_events,
)
from firmware_runtime.executive.deadlines import PathDeadline
from firmware_runtime.executive.fault_log import FaultLog
from firmware_runtime.executive.periodic_account import PeriodicAccount
from firmware_runtime.executive.policy import SKIP, ActivationPolicy
from firmware_runtime.statistics.histogram import Cells
from firmware_runtime.statistics.layout import Layout

EVENT_TOLERANCE = MILLISECOND
"""Lateness, ns, up to which an event of a model without a period is no overrun."""
_READS_INPUT = frozenset({EXTERNAL, CONFLUENT, EXTERNAL_OF_BOTH})


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


class DeadlineWatch:
    """Counts the misses of one deadline.

    During a step it is noted only where in the step a sample left; `answer` and `count_samples` do
    the rest after it.
    """

    def __init__(self, deadline: PathDeadline, simulator: Engine, noted: list[int]) -> None:
        self.deadline = deadline
        self.misses = 0
        self.samples = 0
        self.answers = 0
        self._noted = noted
        self.left: list[int] = []
        """For each sample of the step under way, how much had been noted by then."""
        self._left_at = NEVER
        simulator.listen(deadline.from_port, self._leave)

    def _leave(self, _at: int, _value: object) -> None:
        """A sample leaves the sensor's port."""
        self.left.append(len(self._noted))

    def state(self) -> tuple[int, ...]:
        """Misses, samples, answers, and when the oldest sample on its way left."""
        return self.misses, self.samples, self.answers, self._left_at

    def restore(self, state: tuple[int, ...]) -> None:
        """Have counted that. Raises ValueError for what is no such state."""
        self.misses, self.samples, self.answers, self._left_at = map(kept, state)

    def answer(self, step: Step, place: int, now: int) -> None:
        """The actuator's model has read input and written its outputs, as the clock said `now`.

        So much had been noted in the step by then.
        """
        if self.left:
            self.count_samples(step, place)
        self.answers += 1
        if now - self._left_at > self.deadline.within_ns:
            self.misses += 1
        self._left_at = NEVER

    def count_samples(self, step: Step, place: int) -> None:
        """Count the samples that left before so much had been noted in the step."""
        while self.left and self.left[0] <= place:
            before = self.left.pop(0)
            now = step.laps.noted[before - 2] - step.epoch if before else step.started
            self.samples += 1
            is_missed = now - self._left_at > self.deadline.within_ns
            if self.answers > 0 and is_missed:
                self.misses += 1
            if self.answers == 0 or self._left_at == NEVER or is_missed:
                self._left_at = step.at

    def end(self, now: int) -> None:
        """The run is over: what is not answered will not be."""
        if self.answers > 0:
            if now - self._left_at > self.deadline.within_ns:
                self.misses += 1
            self._left_at = NEVER


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
        touched = self._follow(samples)
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

    def _follow(self, samples: list[object]) -> list[ModelAccount]:
        """See what the step's transitions were; return the accounts that are to count them.

        Of a model without a period that was not due, nothing counts but what it has booked last,
        and that it has reacted: that is counted at once.
        """
        step, accounts, touched = self._step, self.accounts, list[ModelAccount]()
        noted, own_times = step.laps.noted, step.own_times
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
                samples += account.own_time, own_times[number]
                account.reactions = account.cells[REACTIONS] = account.reactions + 1
                if account.due != account.written_due:
                    account.write()
                    account.written_due = account.due
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
            if function in _READS_INPUT:
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
