"""Arming: the one place where it is decided whether outputs may be driven, and taken back.

    disarmed --by request, or at the start where the board says so; all checks pass--> armed
    armed --request, a guard's takeover, a guard gone where one is demanded--> disarmed

A takeover is another epoch in the statistics file (`watched_run`): the guard has written full-off
because it took this process for dead, or `safe-state` on request. The process finds it before its
next write, makes its outputs safe itself, acknowledges, and stays disarmed until it is armed again.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from time import monotonic_ns
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct, field

from firmware_runtime.board.registry import Board
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import text_of
from firmware_runtime.executive.executive import Executive
from firmware_runtime.executive.outcome import OFF_AGAIN_EVERY, Device
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.runs.watched_run import is_requested
from firmware_runtime.statistics.layout import EPOCH, GUARD

if TYPE_CHECKING:
    from firmware_runtime.board.ends import BoardEnd

GUARD_TIMEOUT = SECOND // 2
"""How old the guard's last sign of life may be, ns."""
TRY_EVERY = 100 * MILLISECOND
"""Ns from one attempt to arm, where the board is armed at start, to the next."""
JUDGED = 5 * SECOND
"""How far back lateness is judged, ns."""
LEAST_RATE = 0.95
"""Share of the activations due in the last second that must have been worked off."""
UNJUDGED = 100.0
"""Of activations that may be late, per cent: timing does not matter at all."""

_WITHOUT_FIGURES = str.maketrans("", "", "0123456789.-")

PrearmCheck: TypeAlias = Callable[[int], str | None]
"""A pre-arm check: why outputs must not be driven at this instant of the run; None if they may."""


class Permission(Struct, frozen=True):
    """The terms on which a run may drive its outputs."""

    at_start: bool
    """Arm it as soon as all pre-arm checks pass; otherwise it is armed on request only."""
    demand_guard: bool
    free: bool = False
    """Armed without checks and without a message: its outputs cannot hurt anyone."""
    begun_at: int | None = field(default_factory=monotonic_ns)
    """When the run was called for, ns of CLOCK_MONOTONIC: it does not arm itself after a
    `safe-state` that came later. None where none can mean this run."""


FREE = Permission(at_start=True, demand_guard=False, free=True, begun_at=None)
"""Of a run on doubles of its own, where outputs may have to go off all the same."""


def permission_for(  # noqa: PLR0913 -- the options of the command, by the same names
    board: Board,
    *,
    doubles: bool | Path,
    arm: bool,
    supervised: bool,
    end: "BoardEnd | None" = None,
    begun_at: int | None = None,
) -> Permission | None:
    """The terms on which outputs may be driven; None for doubles within this process.

    Those that another process serves can be switched off by a third: then it takes the run's right
    to drive. An end with the hardware drives while its link is good, also on doubles of its own,
    and the other one has nothing to drive. `supervised` treats doubles as chips; `arm` wants it
    armed, whatever the board says. The run was called for at `begun_at`, now if it is not stated.
    """
    if end is not None and not end.has_hardware:
        return None
    at = monotonic_ns() if begun_at is None else begun_at
    if doubles and not supervised:
        served = Permission(at_start=True, demand_guard=False, free=True, begun_at=at)
        return None if doubles is True and end is None else served
    settings = board.settings.arming
    return Permission(settings.at_start or arm, settings.demand_guard, begun_at=at)


class Arming:
    """A hook of the run, and the interlock that its outputs obey.

    Any of the `checks` that fails keeps it disarmed; those of `commanded` hold whatever the
    permission: a link to a controller in another process, and commands from outside. `make_safe`
    switches outputs off, `enable` lets them through before the first write to them, and raises
    HalError. `last_safe_state` gives the instant of the last `safe-state`: one that came while the
    run was starting could not find it. `log` gets every change, in a sentence; of a run that is to
    arm itself also what stands in the way, again when that changes in more than its figures.
    """

    def __init__(  # noqa: PLR0913 -- put together once, by the session
        self,
        executive: Executive,
        permission: Permission,
        make_safe: Callable[[], list[str]],
        checks: Sequence[PrearmCheck] = (),
        *,
        commanded: Sequence[PrearmCheck] = (),
        last_safe_state: Callable[[], int] = lambda: 0,
        enable: Callable[[], None] = lambda: None,
        log: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.armed = False
        self.was_armed = False
        self.reason = "not requested yet"
        self.is_free = permission.free
        self.is_wanted = permission.at_start
        """Whether it is armed by itself as soon as all pre-arm checks pass."""
        self._demands_guard = permission.demand_guard
        self._executive = executive
        self._make_safe = make_safe
        self._enable = enable
        self._log = log
        self._is_quiet = self.is_free and not commanded
        self._was_said = False
        """Whether it was said to be disarmed, so that being armed again is said, too."""
        own = () if self.is_free else (self._check_guard, *checks)
        self._checks = (*commanded, *own)
        self._is_suspended = False
        self._begun_at = permission.begun_at
        """None once it was compared with the last `safe-state`, too."""
        self._last_safe_state = last_safe_state
        self._epoch = 0
        self._acknowledged = 0
        self._try_at = 0
        self._in_the_way = ""
        """What was last said to stand in the way of arming, without its figures."""
        self._off_again_at = NEVER
        executive.hooks.append(self)

    def interlock(self) -> bool:
        """Output interlock: armed, no takeover since, and the guard there where one is demanded."""
        return (
            self.armed
            and self._executive.cells[EPOCH] == self._epoch
            and not (self._demands_guard and self._guard_is_gone())
        )

    @property
    def epoch(self) -> int:
        """The latest epoch; it is the instant of CLOCK_MONOTONIC, ns, or below zero (`safe-state`).

        Zero while nothing took its right to drive.
        """
        return self._executive.cells[EPOCH]

    def request(self, now: int, epoch: int | None = None) -> list[str]:
        """Arm, unless a pre-arm check fails; return why those that fail do.

        It is armed under this epoch, the present one if none is stated: one that comes while the
        checks are made, or since the caller has judged this one, ends the right to drive.
        """
        self._notice()
        epoch = self.epoch if epoch is None else epoch
        against = [why for check in self._checks if (why := check(now)) is not None]
        if not against and not self.armed:
            against = self._enabled()
        if against:
            self.reason = "; ".join(against)
        elif not self.armed:
            self._epoch = epoch
            self.armed = self.was_armed = True
            self.is_wanted = self._is_suspended = False
            self._off_again_at = NEVER
            self._in_the_way = ""
            self._acknowledge(epoch)
            if self._was_said or not self._is_quiet:
                self._log("armed")
        return against

    def disarm(self, reason: str) -> list[str]:
        """Make the outputs safe and keep them so; return what failed, one sentence each.

        What failed is tried again until it does not: a model may not write for long.
        """
        failed = self._withdraw(reason)
        self._was_said = True
        self._log("; ".join([f"disarmed: {reason}", *failed]))
        return failed

    def suspend(self, reason: str) -> None:
        """Disarm, and arm again as soon as all pre-arm checks pass, if it is armed.

        A takeover meanwhile ends that: then it is armed on request.
        """
        self._notice()
        if self.armed:
            self.disarm(reason)
            self.is_wanted = self._is_suspended = self._keeps_its_right
            self._try_at = 0

    def pause(self) -> list[str]:
        """Make the outputs safe while the run stands still; it is armed again when it goes on.

        That is by the same terms as at first, if it was armed, and it is not disarmed meanwhile.
        Returns what failed, one sentence each.
        """
        self._notice()
        self._try_at = 0
        if not self.armed:
            return self._switch_off()
        why = "the run pauses"
        failed = self._withdraw(why) if self.is_free else self.disarm(why)
        self.is_wanted = self._keeps_its_right
        return failed

    def between_steps(self, now: int, _left: int) -> None:
        """Disarm after a takeover; arm as soon as all pre-arm checks pass, if that is wanted.

        A `safe-state` is said to have come, also to a run that was disarmed before.
        """
        self._notice()
        if self.armed:
            return
        if self._begun_at is not None:
            self._take_from_itself(self._begun_at, self._last_safe_state())
            self._begun_at = None
        if (epoch := self.epoch) != self._acknowledged:
            if is_requested(epoch) or (self.is_wanted and self._is_suspended):
                self.is_wanted = self._is_suspended = False
                self.reason = self._why_withdrawn()
                self._log(f"stays disarmed: {self.reason}")
            self._switch_off()
            self._acknowledge(epoch)
        elif now >= self._off_again_at:
            self._switch_off()
        elif self.is_wanted and now >= self._try_at:
            self._try_at = now + TRY_EVERY
            if against := self.request(now, epoch):
                self._say_in_the_way(against)

    # ---------------------------------------------------------------------------------------------

    def _take_from_itself(self, begun_at: int, safe_state_at: int) -> None:
        """Take the right to drive for a `safe-state` that could not find this run yet.

        It may have been taken since, by one that could: the later instant counts.
        """
        if safe_state_at > begun_at:
            cells = self._executive.cells
            cells[EPOCH] = -max(abs(cells[EPOCH]), safe_state_at)

    def _say_in_the_way(self, against: list[str]) -> None:
        """Log why it is not armed yet, unless that was the last thing logged of it."""
        why = "; ".join(against)
        if (words := why.translate(_WITHOUT_FIGURES)) != self._in_the_way:
            self._in_the_way = words
            self._log(f"not armed yet: {why}")

    def _notice(self) -> None:
        """Disarm where the interlock does not hold any more: a takeover, or no guard."""
        if self.armed and not self.interlock():
            self.disarm(self._why_withdrawn())

    def _withdraw(self, reason: str) -> list[str]:
        """Make the outputs safe, for this reason; return what failed."""
        self.armed = self.is_wanted = self._is_suspended = False
        self.reason = reason
        self._in_the_way = reason.translate(_WITHOUT_FIGURES)
        epoch = self.epoch  # one that comes while they are switched off is another takeover
        failed = self._switch_off()
        self._acknowledge(epoch)
        return failed

    @property
    def _keeps_its_right(self) -> bool:
        """Whether it was disarmed by itself, with nothing having taken its right to drive."""
        return self._acknowledged == self._epoch

    def _enabled(self) -> list[str]:
        """Let outputs through; return why that failed, if it did: then they are off again."""
        try:
            self._enable()
        except HalError as error:
            return [text_of(error), *self._switch_off()]
        return []

    def _switch_off(self) -> list[str]:
        failed = self._make_safe()
        again_at = self._executive.clock.now() + OFF_AGAIN_EVERY
        self._off_again_at = again_at if failed else NEVER
        return failed

    def _acknowledge(self, epoch: int) -> None:
        self._acknowledged = epoch
        self._executive.arm(armed=self.armed, epoch=epoch)

    def _why_withdrawn(self) -> str:
        epoch = self.epoch
        if epoch != self._epoch:
            if is_requested(epoch):
                return "safe-state took its right to drive"
            return "the guard took over, because this process seemed dead"
        return "the guard is gone"

    def _guard_is_gone(self) -> bool:
        return monotonic_ns() - self._executive.cells[GUARD] > GUARD_TIMEOUT

    def _check_guard(self, _now: int) -> str | None:
        if self._demands_guard and self._guard_is_gone():
            return "the guard is absent; expected `firmware-runtime guard` to run for this board"
        return None


def prearm_checks(executive: Executive, max_late_percent: float) -> tuple[PrearmCheck, ...]:
    """Return all checks of this run, but the guard's (`arming`)."""
    return (
        lambda _now: _fifo(executive),
        lambda _now: _devices(executive),
        lambda now: _rate(executive, now),
        lambda now: _lateness(executive, now, max_late_percent),
    )


def _fifo(executive: Executive) -> str | None:
    request = executive.granted.get("fifo_priority")
    if request is None or request.asked == 0 or request.granted:
        return None
    return f"SCHED_FIFO {request.asked} was requested and not granted ({request.reason})"


def _devices(executive: Executive) -> str | None:
    faults = [
        f"{atomic.path} {why}"
        for atomic in executive.simulator.atomics
        if isinstance(atomic, Device) and (why := atomic.unready()) is not None
    ]
    return "; ".join(faults) or None


def _rate(executive: Executive, now: int) -> str | None:
    """Return why the loop does not work off what is due, be it that it skips some."""
    periods = _periods(executive)
    if not periods:
        return None
    if now < SECOND:
        return "the rate has not been measured for a second yet"
    lately = executive.lately(now - SECOND)
    due = sum(max((now - lately.begin_ns) // period - 1, 0) for period in periods)
    done = lately.activations + lately.skipped
    if done >= LEAST_RATE * due:
        return None
    return f"{done / due:.0%} of the activations due lately came; expected {LEAST_RATE:.0%}"


def _lateness(executive: Executive, now: int, max_late_percent: float) -> str | None:
    """Return why activations were too late: too many, or one by more than a period."""
    lately = executive.lately(now - JUDGED)
    late_percent = (
        100 * (lately.late + lately.skipped) / max(lately.activations + lately.skipped, 1)
    )
    period = min(_periods(executive), default=NEVER)
    is_fit = late_percent <= max_late_percent and lately.lateness_max_ns <= period
    if is_fit or max_late_percent == UNJUDGED:
        return None
    latest = "" if period == NEVER else _none_later_than(period)
    return (
        f"{late_percent:.2f} % of the activations of the last {JUDGED // SECOND} s were late or "
        f"skipped, the latest came {lately.lateness_max_ns / MILLISECOND:.1f} ms late; expected at "
        f"most {max_late_percent:g} %{latest}"
    )


def _none_later_than(period: int) -> str:
    return f", and none later than a period ({period / MILLISECOND:g} ms)"


def _periods(executive: Executive) -> list[int]:
    """Return the periods of the models that have one, ns."""
    return [account.period for account in executive.accounts if account.period != NEVER]
