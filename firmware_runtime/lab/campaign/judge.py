"""The judge of a struck robot: it goes by outputs, the world's truth, and faults reported.

| oracle | what is wrong |
|---|---|
| `crash` | something was raised that is no fault of the world, or the process died |
| `hang` | a second of the robot takes no end of processor time |
| `on` | an output is on: the run is over and its lines work, or it is lost, or was disarmed, |
| | or what it needs, as the rig says, fails |
| `held` | outputs have been on and as they are for too long, where the rig says how long is |
| `late` | a device fails at each use, outputs are driven, and nothing was reported in time, |
| | or what was reported is about something else |
| `silent` | the robot left the envelope of its healthy runs, is driven, and nothing was reported |
| `not-finite` | a port has sent a number that is none |
| `astray` | long after a fault, or its report, the robot is driven where no healthy one was |
| `unhealed` | long after a fault outputs are off, or it is still reported |
| `invented` | a fault is reported in a mission without any |
| `idle` | a mission without any fault never has an output on |
| `missed` | a mission without any fault does not come to what it is for, as the rig knows |
| `misused` | in a mission without any fault a chip is used as its data sheet does not allow |
| `account` | activations that were scheduled and those that are accounted for differ |
| `own` | what the board's own oracle says |

A verdict is `sound` once the judge is sure: half a second after a robot is healthy again or a
lasting fault was reported, two where it is driven on, or three seconds after one that shows in
nothing. A robot that has taken a decision of its own, an arrow of a state diagram that no healthy
one has taken by then, is watched until five seconds after the fault. One that has said why and is
driven beside its envelope is watched until five seconds after that.
"""

import copy
from collections.abc import Callable, Sequence
from typing import Final, TypeAlias

from msgspec import Struct

from firmware_runtime.board.rig import Rig
from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import FirmwareRuntimeError, text_of
from firmware_runtime.hal.strike import KINDS, Strike
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.lab.campaign.healthy import Healthy, end_of
from firmware_runtime.lab.campaign.recovery import RECOVER, Recovery
from firmware_runtime.lab.campaign.watched import Look, Said, Watched
from firmware_runtime.statistics.figures import Figures

Oracle: TypeAlias = Callable[[Rig], str | None]
"""An oracle of one's own: a sentence about what is wrong with a rig's world now, or None."""

SOUND: Final = "sound"
ORACLES: Final = (
    *("crash", "hang", "on", "held", "late", "silent", "not-finite", "astray", "unhealed"),
    *("invented", "idle", "missed", "misused", "account", "own"),
)
_SETTLED: Final = 500 * MILLISECOND
_WATCHED: Final = 3 * SECOND
_NAMED: Final = 300 * MILLISECOND
_DRIVEN_ON: Final = 2 * SECOND
_FULL_ON: Final = "full-on"
_LEAD_ASTRAY: Final = frozenset({"push", "hold", "disarm"})
"""Kinds after which a robot that is all right is elsewhere than the healthy ones."""
_KEPT_OFF: Final = frozenset({"stuck", "nack", "nack-data", "arbitration", "fault", "absent"})


class Verdict(Struct, frozen=True, kw_only=True):
    """What became of a struck robot."""

    outcome: str
    """`sound`, or the oracle that found something."""
    what: str = ""
    """A sentence about it."""
    model: str = ""
    at: int = 0
    """When it was known, ns of the run."""
    said: str | None = None
    """The first fault that was reported, `MODEL: KIND`."""
    said_after: int | None = None
    """Ns from the strike to that."""
    struck: bool = False
    """Whether the fault showed on a line."""
    ended: str | None = None
    """Why the run was over, if it was."""
    reached: tuple[str, ...] = ()
    """Arrows of state diagrams that were taken, and are not in healthy runs."""
    digest: str = ""


class Judge:
    """Watches one struck robot, look by look, until it is sure."""

    def __init__(
        self,
        watched: Watched,
        healthy: Healthy,
        strikes: Sequence[Strike],
        oracle: Oracle | None = None,
    ) -> None:
        self._watched = watched
        self._healthy = healthy
        self._oracle = oracle
        self._most_held, self._off_within = healthy.stated.held, healthy.stated.off_within
        self._go_by(strikes)
        kinds = [KINDS[each.kind] for each in strikes]
        shows = all(kind.is_moment or kind.of in {"people", "world"} for kind in kinds)
        self._struck_at = self._at if shows else None
        self._said: Said | None = None
        self._look = Look(0, is_on=False, numbers=())
        self._left_at: int | None = None

    def _go_by(self, strikes: Sequence[Strike]) -> None:
        kinds = [KINDS[each.kind] for each in strikes]
        self._device = next((each.device for each in strikes if each.device), "world")
        self._at = min(each.at for each in strikes)
        self._end = max(end_of(each.at, each.span) for each in strikes)
        self._is_of_world = any(kind.of == "world" for kind in kinds)
        self._is_disarmed = all(kind.name == "disarm" for kind in kinds)
        self._has_failed = all(kind.name not in _LEAD_ASTRAY for kind in kinds)
        self._fails = any(
            kind.fails and each.span > self._healthy.within
            for kind, each in zip(kinds, strikes, strict=True)
        )
        self._failing = [
            (each.device, each.at, end_of(each.at, each.span))
            for kind, each in zip(kinds, strikes, strict=True)
            if kind.fails
        ]
        """What fails at each use, from when and until when."""
        self._may_stay_on = any(kind.name in _KEPT_OFF for kind in kinds)
        self._drives_itself = any(kind.of == "actuator" for kind in kinds)
        self._turns_it = any(kind.name == _FULL_ON for kind in kinds)
        named = {each.device for each in strikes}
        self._holds_outputs = not named.isdisjoint(
            {*self._watched.lines, *self._watched.asked.outputs}
        )
        self._recovery = Recovery(
            self._watched,
            self._healthy,
            (self._at, self._end),
            is_of_world=self._is_of_world,
            may_rest=self._is_of_world or self._turns_it,
            heals=all(kind.fails or kind.of == "chip" for kind in kinds),
            can_be_off=not self._holds_outputs,
        )

    def of_shorter(self, strikes: Sequence[Strike]) -> "Judge":
        """Return the judge of faults that are over sooner, in a run that is the same so far."""
        other = copy.copy(self)
        other._go_by(strikes)  # noqa: SLF001 -- its own
        return other

    def judge(self) -> Verdict:
        """Run on until it is sure, end the run, and return the verdict."""
        return self.judge_until(NEVER) or self.closed()

    def judge_until(self, until: int) -> Verdict | None:
        """Run on until it is sure, or at an instant; None where nothing is wrong."""
        watched = self._watched
        while watched.at < until:
            look = watched.go_on()
            if look.at < self._at:
                continue
            if watched.outcome is not None:
                return self._after_the_end(look)
            found = self._found(look)
            if found is not None:
                return self._verdict(*found, look.at)
            if self.is_sure:
                return None
        return None

    # ---------------------------------------------------------------------------------------------

    def _verdict(self, outcome: str, what: str, at: int, model: str = "") -> Verdict:
        said = self._said
        return Verdict(
            outcome=outcome,
            what=what,
            model=model or self._device,
            at=at,
            said=None if said is None else f"{said.model}: {said.kind}",
            said_after=None if said is None else said.at - self._at,
            struck=self._struck_at is not None,
            ended=None if self._watched.outcome is None else self._watched.outcome.reason,
            reached=tuple(sorted(self._watched.reached - self._healthy.reached)),
            digest=self._watched.digest,
        )

    def _found(self, look: Look) -> tuple[str, str] | None:
        """Return the oracle that finds something wrong, and a sentence."""
        self._take_down()
        self._look = look
        return (
            self._not_finite()
            or self._own()
            or self._disarmed(look)
            or self._blind(look)
            or self._held(look)
            or self._late(look)
            or self._unnamed(look)
            or self._silent(look)
            or self._said_and_astray(look)
            or self._recovery.judge(look)
        )

    def _take_down(self) -> None:
        if self._struck_at is None:
            self._struck_at = self._watched.struck_at
        if self._said is None:
            self._said = self._watched.said(self._at)

    def _not_finite(self) -> tuple[str, str] | None:
        for path in self._watched.not_finite:
            return "not-finite", f"{path} has sent a number that is not finite"
        return None

    def _own(self) -> tuple[str, str] | None:
        said = self._watched.asked.judged()
        if said is None and self._oracle is not None:
            said = self._oracle(self._watched.rig)
        return None if said is None else ("own", said)

    def _disarmed(self, look: Look) -> tuple[str, str] | None:
        """A disarmed robot with an output on, be it one that brakes."""
        within = self._healthy.within
        if not (self._is_disarmed and self._at + within < look.at <= self._end):
            return None
        if self._watched.asked.has_output_on:
            return "on", f"it was disarmed {within / SECOND:g} s ago, and an output is on"
        return None

    def _blind(self, look: Look) -> tuple[str, str] | None:
        """A robot that is driven on without a device that it needs."""
        if self._struck_at is None or not look.is_on:
            return None
        for device, at, end in self._failing:
            most = self._off_within.get(device, NEVER)
            if look.at <= end and look.at - max(at, self._struck_at) > most:
                return "on", f"{device} fails for {most / SECOND:g} s, and it is driven"
        return None

    def _held(self, look: Look) -> tuple[str, str] | None:
        """Outputs that nothing commands any more; a fault of a driving chip, or a bus, holds them.

        A robot that is pushed may drive at its limits for a while.
        """
        most = self._most_held
        if most == NEVER or self._watched.held_for(look) <= most or self._is_of_world:
            return None
        if self._holds_outputs and look.at <= self._end + most:
            return None
        return "held", f"for {most / SECOND:g} s outputs have been on, and none of them has changed"

    def _said_and_astray(self, look: Look) -> tuple[str, str] | None:
        """A robot that is driven far from where healthy ones are long after it has said why."""
        said = self._said
        if said is None or self._end != NEVER or look.at - said.at < RECOVER:
            return None
        if not self._is_aside(look):
            return None
        where = self._healthy.envelope.far_outside(look)
        after = f"{RECOVER / SECOND:g} s after it was reported"
        return None if where is None else ("astray", f"{after} {where}")

    def _is_aside(self, look: Look) -> bool:
        """Whether it is driven, and is not where a healthy one is, though it could be off."""
        if not (look.is_on and self._has_failed) or self._holds_outputs:
            return False
        return self._healthy.envelope.outside(look) is not None

    def _late(self, look: Look) -> tuple[str, str] | None:
        """A device that fails for good, nothing of which is said in time."""
        within = self._healthy.within
        if not (self._fails and self._said is None and look.is_on):
            return None
        if self._struck_at is None or min(look.at, self._end) - self._struck_at <= within:
            return None
        return "late", f"nothing was reported within {within / SECOND:g} s, and outputs are on"

    def _unnamed(self, look: Look) -> tuple[str, str] | None:
        """A device that fails for good, of which no report says that it does."""
        if self._said is None or self._struck_at is None:
            return None
        for device, at, end in self._failing:
            if min(look.at, end) - max(at, self._struck_at) <= _NAMED:
                continue
            places = (place for place in self._healthy.places if place.name == device)
            if not all(self._watched.has_named(place, at) for place in places):
                return "late", f"{device} fails at each use, and only others report something"
        return None

    def _silent(self, look: Look) -> tuple[str, str] | None:
        """A robot that drives beside its envelope, and says nothing.

        What a fault drives by itself while the robot starts up is known once its sensors are up.
        """
        outside = None
        can_know = not self._turns_it or self._healthy.has_been_on(look.at)
        if look.is_on and self._said is None and can_know and self._has_failed:
            outside = self._healthy.envelope.outside(look)
        if outside is None:
            self._left_at = None
            return None
        if self._left_at is None:
            self._left_at = look.at
        if look.at - self._left_at <= self._healthy.within:
            return None
        return "silent", f"{outside}, outputs are on, and nothing was reported"

    @property
    def is_sure(self) -> bool:
        """Whether what comes now changes nothing any more."""
        at = self._watched.at
        if self._end != NEVER:
            well_since = self._recovery.well_since
            is_settled = well_since is not None and at - well_since >= _SETTLED
            return is_settled and (at - self._end >= RECOVER or not self._is_ahead)
        if self._said is None:
            return at - self._at >= _WATCHED
        since = at - self._said.at
        drives_on = self._look.is_on and not self._holds_outputs
        is_settled = since >= (_DRIVEN_ON if drives_on else _SETTLED)
        return (is_settled and not self._is_aside(self._look)) or since > RECOVER

    @property
    def _is_ahead(self) -> bool:
        """Whether a state diagram has gone where no healthy one goes until a while later."""
        return not self._watched.reached <= self._healthy.reached_by(self._watched.at)

    # The end -------------------------------------------------------------------------------------

    def _after_the_end(self, look: Look) -> Verdict:
        """Judge a run that ended by itself."""
        outcome = self._watched.outcome
        assert outcome is not None  # noqa: S101 -- it is over
        self._take_down()
        if outcome.error is not None:
            return self._verdict(
                "crash", text_of(outcome.error), look.at, where_raised(outcome.error)
            )
        figures = self._watched.robot.statistics
        if (found := self._own() or self._found_in_the_end(look, figures)) is not None:
            return self._verdict(*found, look.at)
        return self._verdict(SOUND, "", look.at)

    def closed(self) -> Verdict:
        """End the faults and the run, and judge that."""
        robot, at = self._watched.robot, self._watched.at
        verdict = self._verdict(SOUND, "", at)
        robot.clear_faults()
        try:
            ended = robot.close()
        except HalError as error:
            return self._verdict("on", f"at the end {text_of(error)}", at)
        except FirmwareRuntimeError as error:
            return self._verdict("crash", text_of(error), at, where_raised(error))
        figures = robot.statistics if ended is None else ended.statistics
        found = self._found_in_the_end(self._watched.look(), figures, is_cleared=True)
        return verdict if found is None else self._verdict(*found, at)

    def _found_in_the_end(
        self, look: Look, figures: Figures, *, is_cleared: bool = False
    ) -> tuple[str, str] | None:
        is_kept_off = not is_cleared and look.at <= self._end and self._may_end_on()
        if self._watched.asked.has_output_on and not is_kept_off:
            return "on", "the run is over, and an output is on"
        for path, each in figures.models.items():
            if each.scheduled - each.run - each.skipped - each.coalesced not in {0, each.waiting}:
                return "account", f"{path}: {each.scheduled} scheduled, not all accounted for"
        return self._not_finite()

    def _may_end_on(self) -> bool:
        """Return whether its fault keeps an output on: it drives it, or keeps the robot from it."""
        outcome = self._watched.outcome
        was_said = outcome is not None and bool(outcome.faults)
        return self._drives_itself or (self._may_stay_on and was_said)


def where_raised(error: BaseException) -> str:
    """The file and line in which something was raised."""
    each: BaseException | None = error
    while each is not None and each.__cause__ is not None:
        each = each.__cause__
    traceback = None if each is None else each.__traceback__
    while traceback is not None and traceback.tb_next is not None:
        traceback = traceback.tb_next
    if traceback is None:
        return type(error).__name__
    code = traceback.tb_frame.f_code
    return f"{code.co_filename.rpartition('/')[2]}:{traceback.tb_lineno}"
