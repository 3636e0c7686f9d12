"""What a rig says of its robot for campaigns of faults, in place of what holds for any robot.

Each is an attribute of the rig by this name, and may be left out.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence

import msgspec
from msgspec import Struct

from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Rig
from firmware_runtime.board.rigs import blamed_on_rig
from firmware_runtime.devs.time import NEVER, seconds
from firmware_runtime.errors import ConfigError, expected_one_of
from firmware_runtime.hal.strike import Place
from firmware_runtime.lab.campaign.mission import RECOVER_S, WITHIN_S, faults_of


class Stated(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Limits of a robot, and what it cannot know; spans are in seconds."""

    said_within_s: float = WITHIN_S
    """In which a fault has to be reported or outputs off."""
    healed_within_s: float = RECOVER_S
    """After a fault of a bus, or of a chip's supply, in which outputs have to be on again."""
    held_within_s: float | None = None
    """For which outputs may be on and none of them change: then nothing commands them. None where
    they keep a place, as servos do."""
    off_within_s: Mapping[str, float] = {}
    """After which outputs are off where a device fails at each use, by its name."""
    borne: Mapping[str, float] = {}
    """How far beside healthy runs a number of its truth may be without harm, by its name, such as
    `tachobot.world.yaw_rad`."""
    unknowable: tuple[str, ...] = ()
    """Faults that are as another world to it, `KIND:DEVICE` or `KIND`: they are left out, and a
    report lists them."""
    unpaced: tuple[str, ...] = ()
    """Buses that a mission need not use as often as `loads` of the board says, by name."""
    warned: tuple[str, ...] = ()
    """Models that warn rightly, by path, such as of a chip without magnetometer; any other warning
    is a finding."""

    @property
    def held(self) -> int:
        """Ns of `held_within_s`; NEVER for None."""
        return NEVER if self.held_within_s is None else seconds(self.held_within_s)

    @property
    def off_within(self) -> dict[str, int]:
        """Ns of `off_within_s`."""
        return {name: seconds(span) for name, span in self.off_within_s.items()}


def stated_by(rig: Rig, board: Board, names: Sequence[str], places: Sequence[Place]) -> Stated:
    """Return what a rig says, of a world with numbers by these names and of these places.

    Raises ConfigError for what is of another type, and for names that there are not.
    """
    with blamed_on_rig(board, "what it says for campaigns"):
        found = {
            name: _plain(getattr(rig, name))
            for name in Stated.__struct_fields__
            if hasattr(rig, name)
        }
        stated = msgspec.convert(found, Stated)
    for attribute, faults in (
        ("borne", _unknown(stated.borne, names)),
        ("off_within_s", _unknown(stated.off_within_s, [place.name for place in places])),
        ("unknowable", faults_of(stated.unknowable, places)),
        ("unpaced", _unknown(stated.unpaced, sorted({place.line for place in places}))),
    ):
        if said := list(faults):
            raise ConfigError(f"{board.name}: {attribute} of its rig", said)
    return stated


def _plain(value: object) -> object:
    return dict(value) if isinstance(value, Mapping) else value


def _unknown(found: Iterable[str], known: Sequence[str]) -> Iterator[str]:
    return (expected_one_of(each, known) for each in found if each not in known)
