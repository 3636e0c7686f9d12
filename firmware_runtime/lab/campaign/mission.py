"""Missions: what a robot does while it is struck, and the faults that are made in it."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from msgspec import Struct

from firmware_runtime.board.assignments import assigned
from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.errors import expected_one_of
from firmware_runtime.hal.strike import KINDS, Place, Strike
from firmware_runtime.runs.open_board import OpenBoard, open_board

SEED_KEY: Final = "world.seed"
WITHIN_S: Final = 0.3
"""Seconds in which a fault has to be reported or outputs off, unless the board says otherwise."""
RECOVER_S: Final = 5.0
"""Seconds after a fault in which a robot has to be healthy again."""


class Mission(Struct, frozen=True, kw_only=True):
    """A board with settings that runs for some seconds; equal missions have equal campaigns."""

    board: str
    """As the command line has it: a name, or the path of a board.toml or its folder."""
    assignments: tuple[str, ...] = ()
    """Overrides, `KEY=VALUE`."""
    for_s: float = 10.0
    seed: int | None = None
    """Seed of the world's noise; None is the one of the board's file."""
    within_s: float | None = None
    """Seconds in which a fault has to be said; None is what the board says, else `WITHIN_S`."""
    without: tuple[str, ...] = ()
    """Faults that are left out, `KIND` or `KIND:DEVICE`: those that are known and accepted."""
    pairs: int = 0
    """Pairs of faults that are tried beside each single one."""

    def settings(self, seed: int | None = None) -> dict[str, object]:
        """Return all overrides by key, with another seed if one is given."""
        own = self.seed if seed is None else seed
        seeded = {} if own is None else {SEED_KEY: own}
        return {**dict(map(assigned, self.assignments)), **seeded}

    def opened(
        self,
        strikes: Sequence[Strike] = (),
        seed: int | None = None,
        record: Path | None = None,
    ) -> OpenBoard:
        """Open the robot in virtual time, with faults. Raises ConfigError and HalError."""
        return open_board(
            self.board,
            doubles=True,
            clock="virtual",
            set=self.settings(seed),
            faults=strikes,
            record=record,
        )

    def seeds(self, count: int) -> list[int | None]:
        """Return its own seed and others after it; its own alone where the world has none."""
        world = getattr(board_in_force(self.board, self.assignments).settings, "world", None)
        own = getattr(world, "seed", None) if self.seed is None else self.seed
        if not isinstance(getattr(world, "seed", None), int) or own is None:
            return [None]
        return [own + number for number in range(count)]

    @property
    def words(self) -> list[str]:
        """The words of the command that choose it."""
        found = [self.board]
        for each in self.assignments:
            found += ["--set", each]
        found += ["--for", f"{self.for_s:g}"]
        if self.seed is not None:
            found += ["--seed", str(self.seed)]
        if self.within_s is not None:
            found += ["--within", f"{self.within_s:g}"]
        for each in self.without:
            found += ["--without", each]
        if self.pairs:
            found += ["--pairs", str(self.pairs)]
        return found


def faults_of(words: Sequence[str], places: Sequence[Place] | None = None) -> Iterator[str]:
    """Yield what is wrong with faults to leave out, `KIND` or `KIND:DEVICE`, a sentence each.

    Devices are looked at if the places are known that can be struck.
    """
    for each in words:
        kind, has_device, device = each.partition(":")
        if kind not in KINDS:
            yield f"{each}: {expected_one_of(kind, KINDS)}"
        elif has_device and places is not None:
            names = [place.name for place in places]
            if device not in names:
                yield f"{each}: {expected_one_of(device, names)}"
