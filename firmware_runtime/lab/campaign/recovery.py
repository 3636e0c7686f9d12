"""Recovery of a struck robot: well again in time, or lost, or far from where healthy ones are."""

from typing import Final

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.lab.campaign.cause import Cause
from firmware_runtime.lab.campaign.healthy import Healthy
from firmware_runtime.lab.campaign.watched import Lasting, Look, Said, Watched

_QUIET: Final = 300 * MILLISECOND
_SAID_LATELY: Final = SECOND


class Recovery:
    """Watches a robot from the end of its faults on; `well_since` when it is well."""

    def __init__(self, watched: Watched, healthy: Healthy, cause: Cause) -> None:
        self.well_since: int | None = None
        self._unwell_at = cause.end
        """When it was last off or astray, or the end of its faults."""
        self._watched = watched
        self._healthy = healthy
        self._cause = cause
        self._within = healthy.stated.recovered
        self._after = f"{self._within / SECOND:g} s after the fault"
        is_stated = cause.leaves_no_doubt or cause.is_borne
        self._off_for = healthy.stated.healed if is_stated else self._within
        """How long after them outputs may be off."""
        self._driven_for = Lasting()
        """While it cannot go on."""
        self._on_at = cause.end
        """When outputs were last on, or the end of its faults: a mission that goes on later than
        healthy ones also rests later."""
        self._goes_on_at = cause.end
        """When outputs were on again for the first time after its faults."""
        self._awaited = list(healthy.longest_gaps)
        """Ports of devices that have sent nothing since its faults ended."""

    def begin_anew(self, at: int) -> None:
        """Give it as long from an instant on as after its faults."""
        self._on_at = self._goes_on_at = at
        self.well_since = None

    def judge(self, look: Look) -> tuple[str, str] | None:
        """Return the oracle that finds something wrong, and a sentence."""
        lasts = self._cause.end == NEVER
        if look.at < self._cause.end and not lasts:
            return None
        if (lost := self._watched.asked.lost()) is not None:
            return self._driven_while_lost(look, lost)
        if lasts:
            return None
        is_resting = self._cause.may_rest and not look.is_on
        said = None if self._cause.is_of_world or is_resting else self._watched.said_last()
        if look.is_on:
            self._on_at = max(look.at, self._cause.end)
        off = self._off(look)
        found = off or self._astray(look) or (None if is_resting else self._unready())
        found = found or self._chip_off(look) or self._withheld(look)
        if found is not None:
            self._unwell_at = look.at
        if off is not None:
            self.well_since = None
            if look.at - self._cause.end <= self._off_for:
                self._goes_on_at = look.at
            return off if look.at - self._on_at > self._off_for else None
        found = self._reporting(look, said) or found
        if found is not None:
            self.well_since = None
            return found if look.at - self._goes_on_at > self._within else None
        if self.well_since is None:
            self.well_since = max(self._unwell_at, 0 if said is None else said.at)
        return None

    def _reporting(self, look: Look, said: Said | None) -> tuple[str, str] | None:
        """Return what it reported a moment ago."""
        if said is None or said.at < max(self._cause.end, look.at - _QUIET + 1):
            return None
        return "unhealed", f"{self._after} {said.model} still reports {said.kind}"

    def _off(self, look: Look) -> tuple[str, str] | None:
        """Return that outputs are off which are on when all is well.

        Where the faults have moved it, off is right for as long as something is said.
        """
        if look.is_on or not self._healthy.is_on(look.at) or self._may_rest(look):
            return None
        begin = "the fault" if self._on_at == self._cause.end else "they were last on"
        return "unhealed", f"{self._off_for / SECOND:g} s after {begin} outputs are off"

    def _chip_off(self, look: Look) -> tuple[str, str] | None:
        """Return that a robot is driven, and a chip is off that never is when all is well."""
        if not look.is_on or not self._healthy.always_on or self._may_rest(look):
            return None
        outputs = self._watched.asked.outputs
        off = [chip for chip in sorted(self._healthy.always_on) if not outputs.get(chip)]
        if not off:
            return None
        return "unhealed", f"{self._after} {off[0]} is off, which never is when all is well"

    def _withheld(self, look: Look) -> tuple[str, str] | None:
        """Return that a robot is driven as healthy ones are, and has lost what they measure.

        Be that reported: a device that failed for a while is to come back.
        """
        if not self._awaited:
            return None
        sent = self._watched.last_sent()
        self._awaited = [each for each in self._awaited if sent.get(each, 0) <= self._cause.end]
        is_as_healthy_ones = self._watched.reached <= self._healthy.reached
        if not (self._awaited and look.is_on and is_as_healthy_ones):
            return None
        return "unhealed", f"{self._after} {self._awaited[0]} has sent nothing since then"

    def _may_rest(self, look: Look) -> bool:
        """Return whether the faults have moved it, and it said something lately."""
        said = self._watched.said_last() if self._cause.may_rest else None
        return said is not None and said.at >= look.at - _SAID_LATELY

    def _unready(self) -> tuple[str, str] | None:
        """Return that a device speaks against arming which does not when all is well."""
        for model, why in self._watched.unready().items():
            if model not in self._healthy.unready:
                return "unhealed", f"{self._after} it could not be armed: {model} {why}"
        return None

    def _astray(self, look: Look) -> tuple[str, str] | None:
        """Return how a driven robot is where no healthy one was since; a push takes it anywhere."""
        is_judged = look.is_on and not self._cause.is_of_world
        far = self._healthy.envelope.elsewhere(look, self._cause.at) if is_judged else None
        return None if far is None else ("astray", f"{self._after} {far}")

    def _driven_while_lost(self, look: Look, lost: str) -> tuple[str, str] | None:
        """Judge a robot that cannot go on: it may be off, and is well then."""
        is_on = look.is_on
        if self._cause.end == NEVER:
            is_on = self._watched.is_driven_beside(self._cause.holds)
        if is_on:
            self.well_since = None
        elif self.well_since is None:
            self.well_since = look.at
        is_wrong = self._driven_for.span(look.at, is_so=is_on) > self._healthy.within
        return ("on", f"{lost}, and it is driven") if is_wrong else None
