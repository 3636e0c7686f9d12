"""The judge of a struck robot: it goes by outputs, the world's truth, and faults reported.

A verdict is `sound` once the judge is sure: half a second after a robot is healthy again or a
lasting fault was reported, two where it is driven on, or after a push that it bears, or three
seconds after one that shows in nothing. A robot that has taken a decision of its own, an arrow of a
state diagram that no healthy one has taken by then, is watched until five seconds after the fault,
or after its begin where it lasts. One that has said why and is driven beside its envelope is
watched until five seconds after that. A run may have to go on to the end of its mission: then none
is sure before.
"""

import copy
from collections.abc import Sequence
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND, seconds
from firmware_runtime.errors import FirmwareRuntimeError, text_of
from firmware_runtime.hal.strike import Strike
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.lab.campaign.cause import Cause
from firmware_runtime.lab.campaign.failures import Failures
from firmware_runtime.lab.campaign.going_on import Fulfilment
from firmware_runtime.lab.campaign.healthy import Healthy
from firmware_runtime.lab.campaign.outputs_on import OutputsOn
from firmware_runtime.lab.campaign.rates import SPAN, kept_from, slowed
from firmware_runtime.lab.campaign.recovery import Recovery
from firmware_runtime.lab.campaign.verdict import SOUND, Verdict, where_raised
from firmware_runtime.lab.campaign.watched import SENT, Lasting, Look, Said, Watched
from firmware_runtime.lab.campaign.withheld import withheld
from firmware_runtime.statistics.figures import Figures

_SETTLED: Final = 500 * MILLISECOND
_WATCHED: Final = 3 * SECOND
_NAMED: Final = 300 * MILLISECOND
_DRIVEN_ON: Final = 2 * SECOND
_FALLS_WITHIN: Final = 2 * SECOND
_BORNE: Final = "it was pushed by no more than it bears"
_MUTE: Final = SECOND
"""A robot that is off is safe, and may take longer to say why."""
_OUTLASTS: Final = 300 * MILLISECOND
"""A lasting fault goes on for so long while its run is ended, or half as long as that is tried."""


class Judge:
    """Watches one struck robot, look by look, until it is sure."""

    def __init__(
        self,
        watched: Watched,
        healthy: Healthy,
        strikes: Sequence[Strike],
        *,
        goes_on: bool = False,
    ) -> None:
        self._watched = watched
        self._healthy = healthy
        self._recovered_within = healthy.stated.recovered
        self._go_by(strikes, off_at=0, goes_on=goes_on)
        self._struck_at = self._cause.at if self._cause.shows_by_itself else None
        self._said: Said | None = None
        self._look = Look(0, is_on=False, numbers=())
        self._mute_for, self._outside_for = Lasting(), Lasting()
        self._has_fallen = False
        """Whether it has left its envelope while it was disarmed."""

    def _go_by(self, strikes: Sequence[Strike], off_at: int, *, goes_on: bool) -> None:
        watched, healthy = self._watched, self._healthy
        driving = _driving(watched, healthy)
        self._strikes = strikes
        bears_push = healthy.bears_push(min(each.at for each in strikes))
        self._cause = Cause(strikes, driving, bears_push or 0.0)
        self._failures = Failures(watched, healthy, self._cause)
        self._outputs = OutputsOn(watched, healthy, self._cause, self._failures, off_at)
        self._recovery = Recovery(watched, healthy, self._cause)
        self._fulfilment = Fulfilment(
            watched, healthy, self._cause, self._recovery, goes_on=goes_on
        )

    def of_shorter(self, strikes: Sequence[Strike], *, goes_on: bool) -> "Judge":
        """Return the judge of faults that are over sooner, in a run that is the same so far."""
        other = copy.copy(self)
        other._go_by(strikes, self._outputs.off_at, goes_on=goes_on)  # noqa: SLF001 -- its own
        return other

    def judge(self) -> Verdict:
        """Run on until it is sure, end the run, and return the verdict."""
        return self.judge_until(NEVER) or self.closed()

    def judge_until(self, until: int) -> Verdict | None:
        """Run on until it is sure, or at an instant; None where nothing is wrong."""
        watched = self._watched
        while watched.at < until:
            look = watched.go_on()
            if look.at < self._cause.at:
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
            model=model or self._cause.device,
            at=at,
            said=None if said is None else f"{said.model}: {said.kind}",
            said_after=None if said is None else max(0, said.at - self._cause.at),
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
            or self._outputs.judge(look)
            or self._invented(look)
            or self._changed(look)
            or self._stale(look)
            or self._late(look)
            or self._unnamed(look)
            or self._mute(look)
            or self._withheld(look)
            or self._silent(look)
            or self._felled()
            or self._said_and_astray(look)
            or self._recovery.judge(look)
            or self._fulfilment.judge(look)
        )

    def _take_down(self) -> None:
        if self._struck_at is None:
            self._struck_at = self._watched.struck_at
        if self._said is None:
            self._said = self._watched.said(self._cause.said_from)

    def _not_finite(self) -> tuple[str, str] | None:
        for path in self._watched.not_finite:
            return "not-finite", f"{path} has sent a number that is not finite"
        return None

    def _own(self) -> tuple[str, str] | None:
        """What the board's own oracle says; not of what a lasting fault keeps out of its reach."""
        if self._said is not None and self._cause.out_of_reach_until == NEVER:
            return None
        said = self._watched.asked.judged()
        return None if said is None else ("own", said)

    def _invented(self, look: Look) -> tuple[str, str] | None:
        """A robot that was disarmed, and no more, and reports something: nothing has failed.

        One that falls meanwhile may say so.
        """
        if not self._cause.is_disarmed or self._watched.asked.lost() is not None:
            return None
        if look.at <= self._cause.end and self._healthy.envelope.outside(look) is not None:
            self._has_fallen = True
        said = self._watched.said(self._cause.end if self._has_fallen else self._cause.said_from)
        if said is None:
            return None
        what = f"{said.model} reports {said.kind} ({said.sentence})"
        return "invented", f"{what}, and nothing failed: it was disarmed"

    def _changed(self, look: Look) -> tuple[str, str] | None:
        """A robot that has taken up its settings as they are, and goes on otherwise than without.

        To the bit: it has the gains, the limits and the state that it had.
        """
        before = self._healthy.seen_at(look.at) if self._cause.is_reloaded else None
        if before is None or look == before:
            return None
        numbers = zip(self._healthy.envelope.names, look.numbers, before.numbers, strict=True)
        changes = (
            f"{name} is {now!r}, {was!r} without" for name, now, was in numbers if now != was
        )
        what = next(changes, f"outputs are {'on' if look.is_on else 'off'}, and not without")
        return "changed", f"it took up its settings as they are, and {what}"

    def _felled(self) -> tuple[str, str] | None:
        """A robot that cannot go on since it was pushed, though it bears that."""
        lost = self._watched.asked.lost() if self._cause.is_borne else None
        return None if lost is None else ("unhealed", f"{_BORNE}, and {lost}")

    def _said_and_astray(self, look: Look) -> tuple[str, str] | None:
        """A robot that is driven far from where healthy ones are long after it has said why."""
        said = self._said
        if said is None or self._cause.end != NEVER or look.at - said.at < self._recovered_within:
            return None
        if not self._is_aside(look):
            return None
        where = self._healthy.envelope.far_outside(look)
        after = f"{self._recovered_within / SECOND:g} s after it was reported"
        return None if where is None else ("astray", f"{after} {where}")

    def _is_aside(self, look: Look) -> bool:
        """Whether it is driven, and is not where a healthy one is, though it could be off."""
        if not (look.is_on and self._cause.is_failure) or self._cause.holds:
            return False
        return self._healthy.envelope.outside(look) is not None

    def _stale(self, look: Look) -> tuple[str, str] | None:
        """A device that fails at each use, and whose model goes on sending values all the same.

        One more, or two, may come of what it was asked before.
        """
        for device, since, end in self._failures:
            if look.at > end:
                continue
            places = self._healthy.places
            for name in (each.name for each in places if device in {each.name, each.line}):
                if (path := self._watched.sends_on(name, since)) is not None:
                    return "stale", f"{path} has sent {SENT} values since {name} answered last"
        return None

    def _late(self, look: Look) -> tuple[str, str] | None:
        """A device that fails, nothing of which is said in time, and the robot is driven."""
        within = self._healthy.within
        if self._said is not None or not look.is_on:
            return None
        if any(look.at <= end and look.at - since > within for _, since, end in self._failures):
            return "late", f"nothing was reported within {within / SECOND:g} s, and outputs are on"
        return None

    def _unnamed(self, look: Look) -> tuple[str, str] | None:
        """A device that fails, of which no report says in time that it does."""
        named_within = max(_NAMED, self._healthy.within)
        for device, since, end in self._failures if self._said is not None else ():
            if min(look.at, end) - since <= named_within:
                continue
            places = (place for place in self._healthy.places if place.name == device)
            if not all(self._watched.has_named(place, since) for place in places):
                return "late", f"{device} fails at each use, and only others report something"
        return None

    def _mute(self, look: Look) -> tuple[str, str] | None:
        """A robot that is off for a while where healthy ones are on, and does not say why.

        One that waits for what a sensor tells it, be that a lie, is off and has nothing to say.
        """
        may_be = self._said is None and self._cause.leaves_no_doubt and not look.is_on
        is_mute = may_be and self._healthy.is_on(look.at)
        # what brakes is not driven, and on
        is_mute = is_mute and not self._watched.asked.has_output_on
        most = max(_MUTE, self._healthy.within)
        if self._mute_for.span(look.at, is_so=is_mute) <= most:
            return None
        off = f"outputs have been off for {most / SECOND:g} s, and are on when all is well"
        return "mute", f"{off}, and nothing was reported"

    def _withheld(self, look: Look) -> tuple[str, str] | None:
        """A device whose values no longer come, in a robot that is driven on and says nothing.

        One that has taken other arrows than healthy ones may need no more of it.
        """
        watched, healthy = self._watched, self._healthy
        is_as_healthy_ones = healthy.is_on(look.at) and watched.reached <= healthy.reached
        if self._said is not None or not look.is_on or not is_as_healthy_ones:
            return None
        what = withheld(
            healthy.longest_gaps, watched.last_sent(), look.at, since=self._outputs.off_at
        )
        return None if what is None else ("withheld", f"{what}, and nothing was reported")

    def _silent(self, look: Look) -> tuple[str, str] | None:
        """A robot that drives beside its envelope, and says nothing.

        What a fault drives by itself while the robot starts up is known once its sensors are up.
        One that is told to drive, and whose output does nothing, drives.
        """
        outside = None
        can_know = not self._cause.turns_it or self._healthy.has_been_on(look.at)
        is_on = look.is_on or (self._cause.drives and self._watched.asked.has_output_on)
        if is_on and self._said is None and can_know and self._cause.is_failure:
            outside = self._healthy.envelope.outside(look)
        if self._outside_for.span(look.at, is_so=outside is not None) <= self._healthy.within:
            return None
        return "silent", f"{outside}, outputs are on, and nothing was reported"

    @property
    def is_sure(self) -> bool:
        """Whether what comes now changes nothing any more."""
        return (
            self._watched.at >= self._fulfilment.until
            and self._is_settled
            and not self._outputs.may_be_wrong(self._look)
            and not self._may_go_astray
            and not self._may_still_fall
        )

    @property
    def _is_settled(self) -> bool:
        """Whether it has for a while been well, or said why it is not, or shown nothing."""
        at, cause = self._watched.at, self._cause
        if cause.end != NEVER:
            well_since = self._recovery.well_since
            return well_since is not None and at - well_since >= _SETTLED
        if self._said is None:
            return at - cause.at >= _WATCHED
        since = at - self._said.at
        drives_on = self._watched.is_driven_beside(cause.holds)
        is_long = since >= (_DRIVEN_ON if drives_on else _SETTLED)
        return (is_long and not self._is_aside(self._look)) or since > self._recovered_within

    @property
    def _may_go_astray(self) -> bool:
        """Whether a state diagram has just gone where no healthy one goes until a while later."""
        at, cause = self._watched.at, self._cause
        begin = cause.at if cause.end == NEVER else cause.end
        if at - begin >= self._recovered_within:
            return False
        return not self._watched.reached <= self._healthy.reached_by(at)

    @property
    def _may_still_fall(self) -> bool:
        """Whether it was pushed a moment ago, by what it bears."""
        return self._cause.is_borne and self._watched.at - self._cause.at < _FALLS_WITHIN

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
        found = self._own() or self._found_in_the_end(look, figures)
        found = found or self._invented(look) or self._changed(look) or self._given_up()
        if found is not None:
            return self._verdict(*found, look.at)
        return self._verdict(SOUND, "", look.at)

    def _given_up(self) -> tuple[str, str] | None:
        """A run that has ended of a fault that was over at once, where its rig says that none does.

        A device that fails at its very first use may keep a run from beginning.
        """
        ending = self._watched.session.task.ending
        if ending is None or not ending.failed:
            return None
        if self._cause.is_disarmed and self._watched.asked.lost() is None:
            return "invented", f"it was disarmed, and the run has ended: {ending.reason}"
        if self._cause.is_borne:
            return "unhealed", f"{_BORNE}, and the run has ended: {ending.reason}"
        if not (self._cause.is_over_at_once and self._heals):
            return None
        return "unhealed", f"the fault was over at once, and the run has ended: {ending.reason}"

    @property
    def _heals(self) -> bool:
        """Whether its rig says that nothing that is over at once, as its faults are, ends a run."""
        stated = self._healthy.stated
        if self._cause.leaves_no_doubt:
            return stated.healed_within_s is not None
        return self._cause.is_of_readings and {*self._cause.devices} <= {*stated.bears_reading_of}

    def closed(self) -> Verdict:
        """End the run amid its faults, and judge that."""
        robot, at = self._watched.robot, self._watched.at
        verdict = self._verdict(SOUND, "", at)
        seldom = self._slowed(at)
        hardware = self._watched.session.hardware
        tried_for = seconds(robot.board.settings.executive.switch_off_s)
        hardware.struck.end(hardware.world_now() + min(_OUTLASTS, tried_for // 2))
        try:
            ended = robot.close()
        except HalError as error:
            return self._verdict("on", f"at the end {text_of(error)}", at)
        except FirmwareRuntimeError as error:
            return self._verdict("crash", text_of(error), at, where_raised(error))
        robot.clear_faults()
        figures = robot.statistics if ended is None else ended.statistics
        found = self._found_in_the_end(self._watched.look(), figures, is_cleared=True) or seldom
        return verdict if found is None else self._verdict(*found, at)

    def _slowed(self, at: int) -> tuple[str, str] | None:
        """A device that it uses less often than a healthy one, which has taken the same arrows."""
        healthy, watched = self._healthy, self._watched
        since = max(self._outputs.off_at, self._cause.at)
        if at - since < SPAN or not watched.reached <= healthy.reached:
            return None
        least = dict(healthy.least_uses)
        if at - self._cause.end < SPAN:
            for name in kept_from(self._strikes, healthy.places):
                least.pop(name, None)
        what = slowed(healthy.places, watched.lines, at, least)
        return None if what is None else ("slowed", what)

    def _found_in_the_end(
        self, look: Look, figures: Figures, *, is_cleared: bool = False
    ) -> tuple[str, str] | None:
        is_kept_off = not is_cleared and look.at <= self._cause.end and self._may_end_on()
        if self._watched.asked.has_output_on and not is_kept_off:
            return "on", "the run is over, and an output is on"
        for path, each in figures.models.items():
            if not each.is_accounted_for:
                return "account", f"{path}: {each.scheduled} scheduled, not all accounted for"
        return self._not_finite()

    def _may_end_on(self) -> bool:
        """Return whether its fault keeps an output on: it drives it, or keeps the robot from it."""
        outcome = self._watched.outcome
        was_said = outcome is not None and bool(outcome.faults)
        return self._cause.drives or (self._cause.may_stay_on and was_said)


def _driving(watched: Watched, healthy: Healthy) -> dict[str, list[str]]:
    """Return the chips that drive: each by itself, and those on a line by its name.

    Outputs by another name than a device's may be of any chip.
    """
    chips, line_of = list(watched.asked.outputs), {each.name: each.line for each in healthy.places}
    found = {chip: [chip, *(each for each in chips if each not in line_of)] for chip in chips}
    for line in watched.lines:
        found[line] = [chip for chip in chips if line_of.get(chip, line) == line]
    return found
