"""Outputs that are on though they have to be off: as the rig says, or as nothing commands them."""

from collections.abc import Iterator
from itertools import chain
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.lab.campaign.cause import Cause
from firmware_runtime.lab.campaign.failures import Failures
from firmware_runtime.lab.campaign.healthy import Healthy
from firmware_runtime.lab.campaign.watched import EVERY, Lasting, Look, Said, Watched

_AGAIN: Final = 2 * SECOND
"""One that reports no more for so long has stopped to do so."""
_STOPPED: Final = 100 * MILLISECOND
"""Outputs off for so long were switched off; what drives to and fro is off for a moment only."""


class _Reporting:
    """A model whose lasting fault has to end the run within `most` ns of its reports."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.reports, self.drives = Lasting(), Lasting()
        """For how long it has reported, and the robot has been driven all the same."""


class OutputsOn:
    """Goes by the outputs of one run, look by look; `off_at` is when they were last off."""

    def __init__(
        self,
        watched: Watched,
        healthy: Healthy,
        cause: Cause,
        failures: Failures,
        off_at: int = 0,
    ) -> None:
        self.off_at = off_at
        self._watched = watched
        self._cause = cause
        self._failures = failures
        self._most_held, self._within = healthy.stated.held, healthy.within
        names = {place.name for place in healthy.places}
        off_within = healthy.stated.off_within.items()
        self._off_within = {name: span for name, span in off_within if name in names}
        self._off_after = {path: span for path, span in off_within if path not in names}
        """Ns after which outputs are off where a device fails, and where a model has reported."""
        self._off_for, self._stopped_at = Lasting(), 0
        """When outputs were last switched off, for longer than a moment."""
        self._healed = healthy.stated.healed
        ends_within = healthy.stated.ends_within if cause.end == NEVER else {}
        self._reporting = {path: _Reporting(most) for path, most in ends_within.items()}
        """Models whose lasting fault has to end the run."""
        self._envelope = healthy.envelope

    def judge(self, look: Look) -> tuple[str, str] | None:
        """Return the oracle that finds something wrong, and a sentence."""
        if not look.is_on:
            self.off_at = look.at
        if (span := self._off_for.span(look.at, is_so=not look.is_on)) >= _STOPPED:
            self._stopped_at = look.at - span
        return (
            self._disarmed(look)
            or self._blind(look)
            or self._given_nothing(look)
            or self._driven_on(look)
            or self._believed_again(look)
            or self._again_and_again(look)
            or self._held(look)
        )

    def may_be_wrong(self, look: Look) -> bool:
        """Whether they are on, and will have to be off soon.

        As a model has reported, or a device fails; or they may come on again, by a sensor that it
        brings up and believes though it stands still.
        """
        if any(look.at - said.at <= self._healed for _, said in self._found_to_stand(look)):
            return True
        if not look.is_on or look.at < self._reached_from:
            return False
        is_blind = any(
            device in self._off_within and look.at <= end for device, _, end in self._failures
        )
        is_reported = any(
            model.reports.since is not None
            and look.at - model.reports.since <= model.most + 2 * self._within
            for model in self._reporting.values()
        )
        soon = chain(self._giving_nothing(look), self._to_be_off(look))
        return is_blind or is_reported or any(True for _ in soon)

    def _disarmed(self, look: Look) -> tuple[str, str] | None:
        """A disarmed robot with an output on, be it one that brakes."""
        within = self._within
        if not any(at + within < look.at <= end for at, end in self._cause.disarmed):
            return None
        if self._watched.asked.has_output_on:
            return "on", f"it was disarmed {within / SECOND:g} s ago, and an output is on"
        return None

    def _blind(self, look: Look) -> tuple[str, str] | None:
        """A robot that is driven on without a device that it needs, and could be off."""
        for device, since, end in self._failures if look.is_on else ():
            most = self._off_within.get(device, NEVER)
            if look.at <= end and look.at - max(since, self._reached_from) > most:
                return "on", f"{device} fails for {most / SECOND:g} s, and it is driven"
        return None

    def _given_nothing(self, look: Look) -> tuple[str, str] | None:
        """A robot that is driven on without what it needs, which answers, and measures nothing."""
        for device, since, most in self._giving_nothing(look):
            if look.at - since > most:
                what = f"{device} has reported, and sent nothing, for {most / SECOND:g} s"
                return "on", f"{what}, and it is driven"
        return None

    def _giving_nothing(self, look: Look) -> Iterator[tuple[str, int, int]]:
        """Yield each struck device that it needs, that reports, and sends nothing.

        And since when it does so and it is driven, and for how long outputs may be on.
        """
        for device in self._cause.devices if look.at <= self._cause.end else ():
            most, said = self._off_within.get(device), self._watched.said_last(device)
            sent_at = self._watched.sent_last(device)
            if most is None or said is None or sent_at is None:
                continue
            if sent_at < said.at and look.at - said.at <= most:
                since = max(sent_at, self._cause.at, self._reached_from, self.off_at)
                yield device, since, most + self._within

    @property
    def _reached_from(self) -> int:
        """From when on it could switch off what is on."""
        until = self._cause.out_of_reach_until
        return 0 if until and self._watched.is_driven_beside(self._cause.holds) else until

    def _driven_on(self, look: Look) -> tuple[str, str] | None:
        """A robot that is driven on although a model has said what it may not be driven with."""
        for path, since, most in self._to_be_off(look):
            if look.at - since > most:
                what = f"{path} reported a fault {most / SECOND:g} s ago, and it is driven on"
                return "on", what
        return None

    def _to_be_off(self, look: Look) -> Iterator[tuple[str, int, int]]:
        """Yield each model that has reported, since when, and for how long outputs may be on.

        None where they were off since then, or are out of reach.
        """
        begin = self._reached_from
        if not look.is_on or look.at < begin:
            return
        for path, most in self._off_after.items():
            said = self._watched.said(self._cause.said_from, path)
            if said is not None and self.off_at < said.at:
                yield path, max(said.at, begin), most

    def _found_to_stand(self, look: Look) -> Iterator[tuple[str, Said]]:
        """Yield each sensor that it needs, that stands still and has said so, and what it said."""
        for device, end in self._cause.standing:
            if device not in self._off_within or look.at > end:
                continue
            if (said := self._watched.said(self._cause.said_from, device)) is not None:
                yield device, said

    def _believed_again(self, look: Look) -> tuple[str, str] | None:
        """A robot that was stopped because a sensor stands still, and is driven by it."""
        for device, said in self._found_to_stand(look) if look.is_on else ():
            if said.at - EVERY <= self._stopped_at <= said.at + self._within:
                return "on", f"{device} reported {said.kind}, is as it was, and drives it again"
        return None

    def _again_and_again(self, look: Look) -> tuple[str, str] | None:
        """A robot that is driven on by what does not do as it is told, as it says itself.

        One that was off since the last report begins anew, and has as long to be off again as for
        any report. One that is where healthy robots are is degraded, and has said so.
        """
        for path, model in self._reporting.items():
            said_at = self._said_lately(path, look)
            reports_for = model.reports.span(look.at, is_so=said_at is not None)
            is_driven = said_at is not None and self.off_at < said_at and look.is_on
            driven_for = model.drives.span(look.at, is_so=is_driven)
            is_long = reports_for > model.most and driven_for > self._within
            if is_long and self._is_beside(look):
                since = f"has reported again and again for {model.most / SECOND:g} s"
                return "on", f"{path} {since}, and it is driven on"
        return None

    def _is_beside(self, look: Look) -> bool:
        """Return whether it is where no healthy one is, or nothing tells where it is."""
        envelope = self._envelope
        return not envelope.names or envelope.outside(look) is not None

    def _said_lately(self, path: str, look: Look) -> int | None:
        """Return when a model has reported a moment ago; None where it has not."""
        most = self._reporting[path].most
        said = self._watched.said_last(path)
        return said.at if said is not None and look.at - said.at <= min(_AGAIN, most) else None

    def _held(self, look: Look) -> tuple[str, str] | None:
        """Outputs that nothing commands any more; a fault of a driving chip, or a bus, holds them.

        A robot that is pushed may drive at its limits for a while.
        """
        most = self._most_held
        if most == NEVER or self._watched.held_for(look) <= most or self._cause.is_of_world:
            return None
        if self._cause.holds and look.at <= self._cause.end + most:
            return None
        return "held", f"for {most / SECOND:g} s outputs have been on, and none of them has changed"
