"""Runs that go on to the end of their mission: after a fault that is over, it has to be fulfilled.

A robot may be well again, drive its outputs and report nothing, and yet have given up what it is
for. Its healthy runs say whether the mission ends by itself, and its rig what it is for (`missed`).
One that cannot go on is put back, where its rig can do that (`restore`), and has to begin again: a
robot whose fault is over in the first half of its mission is so in any run.
A fault that lasts excuses that, but may show in nothing for long, as where a tank runs dry.
To go on takes many times as long as to be sure that the robot is well, so a few runs do: one of
each kind of fault of each device, and one of the same that lasts, and all that people do as a state
of the robot changes.
"""

from collections.abc import Iterable
from typing import Final

from firmware_runtime.devs.time import NEVER, SECOND, seconds
from firmware_runtime.hal.strike import KINDS, Strike
from firmware_runtime.lab.campaign.cause import Cause
from firmware_runtime.lab.campaign.courses import as_states_change, others_per_mission
from firmware_runtime.lab.campaign.healthy import Healthy
from firmware_runtime.lab.campaign.recovery import Recovery
from firmware_runtime.lab.campaign.space import Space
from firmware_runtime.lab.campaign.watched import Lasting, Look, Watched

_FOUND_AFTER: Final = SECOND
"""How long one that cannot go on is left alone, its faults being over."""
_TIMES: Final = 2
"""A mission that was kept up may begin anew."""


def going_on(space: Space, chosen: Iterable[int]) -> frozenset[int]:
    """Return the numbers of those that go on: a pure function of what is chosen, in its order.

    The first one of each kind of each device that is over in the first half of the mission, and the
    first that lasts from then on; those of people, whom a robot meets every day, at once, and
    others now and then; and all of what people do as a state changes.
    """
    others = others_per_mission(space.found)
    at_arrows = frozenset(as_states_change(space))
    mission = seconds(space.found.mission.for_s)
    tried: set[tuple[str, str, bool]] = set()
    found: set[int] = set()
    for count, number in enumerate(chosen):
        if number >= space.singles:
            continue
        if number in at_arrows:
            found.add(number)
            continue
        (strike,) = space[number].strikes
        fault = strike.kind, strike.device, strike.span == NEVER
        if fault in tried or not _may_go_on(strike, mission):
            continue
        if KINDS[strike.kind].of == "people" or len(tried) * others <= count:
            tried.add(fault)
            found.add(number)
    return frozenset(found)


def _may_go_on(strike: Strike, mission: int) -> bool:
    span = 0 if strike.span == NEVER else strike.span
    return 2 * (strike.at + span) <= mission


class Fulfilment:
    """Asks a robot whose run goes on for what it is for, at the end of its mission.

    `until` is that end, ns, and 0 where the run need not go on. A robot has as long as healthy
    ones; for a mission that ends by itself twice as long, and more after the fault. One whose fault
    lasts is not asked.
    """

    def __init__(
        self,
        watched: Watched,
        healthy: Healthy,
        cause: Cause,
        recovery: Recovery,
        *,
        goes_on: bool,
    ) -> None:
        self._watched = watched
        self._recovery = recovery
        self._lost_for = Lasting()
        self._put_back_at: int | None = None
        self._ends_at = healthy.ends_at
        self._over_at = cause.end
        self._recovered_within = healthy.stated.recovered
        self._asked_from = cause.end + self._recovered_within
        self.until = 0
        self._mission_ends_at = healthy.until
        is_over_early = 2 * cause.end <= seconds(healthy.mission.for_s)
        self._is_put_back = is_over_early and "restore" in healthy.answers
        if goes_on:
            self.until = healthy.until
            if self._ends_at is not None and cause.end != NEVER:
                self.until = max(self.until, _TIMES * self._ends_at + self._asked_from)

    def judge(self, look: Look) -> tuple[str, str] | None:
        """Return the oracle that finds something wrong, and a sentence, when it is time."""
        asked = self._watched.asked
        lost = asked.lost() if self.until or self._is_put_back else None
        if lost is not None:
            self.until = max(self.until, self._mission_ends_at)
            return self._put_back(look, lost)
        if look.at < self._asked_from or not self.until:
            return None
        missed = asked.missed()  # it may go by what it saw before
        said = self._watched.said_last()
        is_said = said is not None and said.at > look.at - self._recovered_within
        if look.at < self.until or is_said:
            return None
        if missed is None and self._ends_at is not None:
            usual = f"{self._ends_at / SECOND:.3g} s when all is well"
            missed = f"its mission has not ended, which it does after {usual}"
        since = f"{(look.at - self._over_at) / SECOND:.2g} s after the fault was over"
        return None if missed is None else ("missed", f"{missed}, {since}")

    def _put_back(self, look: Look, lost: str) -> tuple[str, str] | None:
        """Put back a robot that cannot go on; once, and then it has to stay so."""
        if self._put_back_at is not None:
            since = (look.at - self._put_back_at) / SECOND
            return "missed", f"it was put back {since:.2g} s ago, and {lost}"
        is_left = self._lost_for.span(look.at, is_so=look.at > self._over_at) >= _FOUND_AFTER
        is_time = look.at + self._recovered_within + _FOUND_AFTER <= self.until
        if is_left and is_time and self._watched.asked.restore():
            self._put_back_at = look.at
            self._asked_from = look.at + self._recovered_within
            self._recovery.begin_anew(look.at)
        return None
