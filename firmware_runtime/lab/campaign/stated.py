"""What a rig says of its robot for campaigns of faults, in place of what holds for any robot.

Each is an attribute of the rig by this name, and may be left out.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Final, TypeAlias

import msgspec
from msgspec import Meta, Struct

from firmware_runtime.board import strict
from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Rig
from firmware_runtime.board.rigs import blamed_on_rig
from firmware_runtime.devs.time import NEVER, seconds
from firmware_runtime.errors import ConfigError, expected_one_of, nearest
from firmware_runtime.hal.strike import Place
from firmware_runtime.lab.campaign.asked import ANSWERS
from firmware_runtime.lab.campaign.mission import RECOVER_S, WITHIN_S, faults_of

Span: TypeAlias = Annotated[float, Meta(gt=0, le=60)]
_MISSPELT: Final = 0.85
"""Share of letters from which on an attribute is taken for one of these."""


class Stated(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """Limits of a robot, and what it cannot know; spans are in seconds."""

    said_within_s: Span = WITHIN_S
    """In which a fault has to be reported or outputs off."""
    recovered_within_s: Span = RECOVER_S
    """After a fault, in which it has to be where healthy ones are, and to report nothing more."""
    healed_within_s: Span | None = None
    """After a fault of a bus, or of a chip's supply, in which outputs have to be on again; and no
    run ends of one that was over at once. None is `recovered_within_s`, and a run that may end."""
    held_within_s: Span | None = None
    """For which outputs may be on and none of them change: then nothing commands them. None where
    they keep a place, as servos do."""
    off_within_s: Mapping[str, Span] = {}
    """After which outputs are off where a device fails at each use, by its name, or where a model
    has reported a fault, by its path."""
    ends_within_s: Mapping[str, Span] = {}
    """After which the run is over, or outputs are off, where a model has reported again and again
    since, by its path."""
    borne: Mapping[str, Annotated[float, Meta(ge=0)]] = {}
    """How far beside healthy runs a number of its truth may be without harm, by its name, such as
    `tachobot.world.yaw_rad`."""
    bears_push: Annotated[float, Meta(gt=0, le=1e9)] | None = None
    """The greatest push, in its `push_unit`, that neither ends its run nor leaves it lost: it is
    pushed by that. None is 1, and whatever comes of it is right."""
    bears_reading_of: tuple[str, ...] = ()
    """Devices one wrong reading of which ends no run, by name."""
    also_in: tuple[str, ...] = ()
    """Settings in which a mission without any fault is sound, too, one at a time, `KEY=VALUE`."""
    unknowable: tuple[str, ...] = ()
    """Faults that are as another world to it, `KIND:DEVICE` or `KIND`: they are left out, and a
    report lists them."""
    unpaced: tuple[str, ...] = ()
    """Buses that a mission need not use as often as `loads` of the board says, by name."""
    warned: tuple[str, ...] = ()
    """Models that warn rightly, by path, such as of a chip without magnetometer; any other warning
    is a finding."""

    @property
    def limits(self) -> dict[str, object]:
        """Return what is not as everywhere, by attribute; what is left out is told elsewhere."""
        stated = msgspec.to_builtins(self)
        return {name: value for name, value in stated.items() if name != "unknowable"}

    @property
    def held(self) -> int:
        """Ns of `held_within_s`; NEVER for None."""
        return NEVER if self.held_within_s is None else seconds(self.held_within_s)

    @property
    def healed(self) -> int:
        """Ns of `healed_within_s`, or of what holds for any robot."""
        if self.healed_within_s is None:
            return self.recovered
        return seconds(self.healed_within_s)

    @property
    def recovered(self) -> int:
        """Ns of `recovered_within_s`."""
        return seconds(self.recovered_within_s)

    @property
    def off_within(self) -> dict[str, int]:
        """Ns of `off_within_s`."""
        return {name: seconds(span) for name, span in self.off_within_s.items()}

    @property
    def ends_within(self) -> dict[str, int]:
        """Ns of `ends_within_s`."""
        return {path: seconds(span) for path, span in self.ends_within_s.items()}


def stated_by(
    rig: Rig, board: Board, names: Sequence[str], places: Sequence[Place], models: Sequence[str]
) -> Stated:
    """Return what a rig says, of a world with numbers by these names, of these places and models.

    Raises ConfigError for what is of another type or cannot be, for names that there are not, and
    for an attribute that is called nearly as one of these.
    """
    with blamed_on_rig(board, "what it says for campaigns"):
        found = {
            name: _plain(getattr(rig, name))
            for name in Stated.__struct_fields__
            if hasattr(rig, name)
        }
    faults = [*_misspelt(rig)]
    stated = strict.convert(found, Stated, faults)
    if stated is None or faults:
        raise ConfigError(f"{board.name}: its rig", faults)
    devices = [place.name for place in places]
    for attribute, unknown in (
        ("bears_reading_of", _unknown(stated.bears_reading_of, devices)),
        ("borne", _unknown(stated.borne, names) if names else map(_no_number, stated.borne)),
        (
            "off_within_s",
            _unknown(stated.off_within_s, list(dict.fromkeys([*devices, *models]))),
        ),
        ("ends_within_s", _unknown(stated.ends_within_s, models)),
        ("unknowable", faults_of(stated.unknowable, places)),
        ("unpaced", _unknown(stated.unpaced, sorted({place.line for place in places}))),
        ("warned", _unknown(stated.warned, models)),
    ):
        if said := list(unknown):
            raise ConfigError(f"{board.name}: {attribute} of its rig", said)
    return stated


def _misspelt(rig: Rig) -> Iterator[str]:
    known, names = {*Stated.__struct_fields__, *ANSWERS}, set(dir(rig))
    for name in sorted(names - known):
        if (meant := nearest(name, known - names, _MISSPELT)) is not None:
            yield f"{name}: did you mean {meant}?"


def _plain(value: object) -> object:
    return dict(value) if isinstance(value, Mapping) else value


def _no_number(name: str) -> str:
    return f"{name}: there are no numbers in truth()"


def _unknown(found: Iterable[str], known: Sequence[str]) -> Iterator[str]:
    return (f"{each}: {expected_one_of(each, known)}" for each in found if each not in known)
