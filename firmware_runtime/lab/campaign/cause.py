"""The faults of one run, as far as a judge goes by them: when, of what, and what they excuse."""

from collections.abc import Collection, Mapping, Sequence
from typing import Final, NamedTuple

from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.hal.strike import KINDS, Kind, Strike, interval_of

_FULL_ON: Final = "full-on"
_AT_ONCE: Final = 50 * MILLISECOND
_STEP: Final = 20 * MILLISECOND
"""A report has the instant of its step, and a use that when the wire is at it, which is later."""
_LEAD_ASTRAY: Final = frozenset({"push", "hold", "disarm"})
"""Kinds after which a robot that is all right is elsewhere than the healthy ones."""
_KEPT_OFF: Final = frozenset({"stuck", "nack", "nack-data", "arbitration", "fault", "absent"})

_STANDS: Final = frozenset({"freeze", "freeze-axis"})
"""Kinds by which a sensor stands still: it answers, and gives what it gave before."""
_DRIVEN: Final = frozenset({_FULL_ON, "ignored"})
"""Kinds that keep an output on."""


class Failing(NamedTuple):
    """What fails at each use, by its name, from `at` until `end`, ns of the run."""

    device: str
    kind: Kind
    at: int
    end: int


class Cause:
    """One fault, two of a pair, or one that comes again.

    `driving` has the chips that drive, by themselves and by line; `bears_push` is the greatest push
    that does the robot no harm.
    """

    def __init__(
        self,
        strikes: Sequence[Strike],
        driving: Mapping[str, Collection[str]],
        bears_push: float = 0.0,
    ) -> None:
        kinds = [KINDS[each.kind] for each in strikes]
        self.devices = [each.device for each in strikes if each.device]
        self.device = next(iter(self.devices), "world")
        self.at = min(each.at for each in strikes)
        self.said_from = self.at - _STEP
        """Since when a report is of it."""
        self.end = max(end_of(each.at, each.span) for each in strikes)
        self.shows_by_itself = all(
            kind.is_moment or kind.of in {"people", "world"} for kind in kinds
        )
        """Whether it is no matter of lines, so that it shows as it is made."""
        self.is_of_world = any(kind.of == "world" for kind in kinds)
        self.is_disarmed = all(kind.name == "disarm" for kind in kinds)
        self.is_reloaded = all(kind.name == "reload" for kind in kinds)
        self.disarmed = [
            (each.at, end_of(each.at, each.span)) for each in strikes if self.is_disarmed
        ]
        """From when to when, each time, where nothing else is done to it."""
        self.is_failure = all(kind.name not in _LEAD_ASTRAY for kind in kinds)
        """Whether a robot that is all right stays where healthy ones are."""
        self.failing = [
            Failing(each.device, kind, each.at, end_of(each.at, each.span))
            for kind, each in zip(kinds, strikes, strict=True)
            if kind.fails
        ]
        stands = all(kind.name in _STANDS for kind in kinds)
        self.standing = [(each.device, end_of(each.at, each.span)) for each in strikes if stands]
        """Sensors that stand still, by name, and until when, where nothing else is done to it."""
        self.may_stay_on = any(kind.name in _KEPT_OFF for kind in kinds)
        self.drives = any(kind.of == "actuator" for kind in kinds)
        self.turns_it = any(kind.name == _FULL_ON for kind in kinds)
        self.holds = frozenset(chip for each in self.devices for chip in driving.get(each, ()))
        """Chips that it may keep the robot from."""
        out_of_reach = [
            end_of(each.at, each.span)
            for each in strikes
            if driving.get(each.device) and each.kind in _KEPT_OFF | _DRIVEN
        ]
        self.out_of_reach_until = max(out_of_reach, default=0)
        """Until when nothing may reach what drives, or it drives by itself."""
        self.is_borne = all(
            each.kind == "push" and abs(each.extent or 0.0) <= bears_push for each in strikes
        )
        """Whether it is a push that the robot bears."""
        self.may_rest = (self.is_of_world or self.turns_it) and not self.is_borne
        """Whether it has moved the robot, so that this may be off for as long as it says why."""
        self.leaves_no_doubt = all(kind.leaves_no_doubt for kind in kinds)
        self.is_of_readings = all(kind.of in {"I2C", "sensor"} for kind in kinds)
        are_over_at_once = all(each.span <= _AT_ONCE for each in strikes)
        comes_again = interval_of(strikes) is not None
        self.is_over_at_once = are_over_at_once and (comes_again or self.end - self.at <= _AT_ONCE)
        """Whether all of it is, or each time that it comes again."""


def end_of(at: int, span: int) -> int:
    """The instant at which a fault is over; NEVER for one without an end."""
    return NEVER if span == NEVER else at + span
