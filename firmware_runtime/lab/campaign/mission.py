"""Missions: what a robot does while it is struck, and the faults that are made in it."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from msgspec import Struct

from firmware_runtime.board.assignments import assigned, set_words
from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.board.rigs import has_rig
from firmware_runtime.errors import ConfigError, expected_one_of
from firmware_runtime.hal.strike import KINDS, Place, Strike
from firmware_runtime.hal.wire_errors import HalError
from firmware_runtime.runs.open_board import OpenBoard, open_board

SEED_KEY: Final = "world.seed"
WITHIN_S: Final = 0.3
"""Seconds in which a fault has to be reported or outputs off, unless the board says otherwise."""
RECOVER_S: Final = 5.0
"""Seconds after a fault in which a robot has to be healthy again."""
_MOST_S: Final = 3600.0


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

    @contextmanager
    def running(self, seed: int | None = None) -> Iterator[OpenBoard]:
        """Open it without faults; what goes wrong in it is raised, and not what comes of that."""
        robot = self.opened(seed=seed)
        try:
            yield robot
        except BaseException:
            with suppress(HalError):
                robot.close()
            raise
        robot.close()

    def seeds(self, count: int) -> list[int | None]:
        """Return its own seed and others after it; its own alone where the world has none."""
        world = getattr(board_in_force(self.board, self.assignments).settings, "world", None)
        own = getattr(world, "seed", None) if self.seed is None else self.seed
        if not isinstance(getattr(world, "seed", None), int) or own is None:
            return [None]
        return [own + number for number in range(count)]

    def faults(self) -> Iterator[str]:
        """Yield what is wrong with it, one sentence each."""
        yield from self.span_faults()
        if self.pairs < 0:
            yield f"--pairs: {self.pairs}; expected 0 or more"
        yield from (f"--without {each}" for each in faults_of(self.without))
        try:
            board = board_in_force(self.board, self.assignments)
        except ConfigError as error:
            yield from (f"{error.where}: {each}" for each in error.faults)
            return
        if not has_rig(board):
            yield f"{board.name} has no doubles; expected a board with a rig"
        elif self.seed is not None and self.seeds(1) == [None]:
            yield f"--seed: {board.name} has no {SEED_KEY}; expected it left out"

    def span_faults(self) -> Iterator[str]:
        """Yield what is wrong with its times."""
        yield from span_faults("--for", self.for_s)
        yield from span_faults("--within", self.within_s)

    @property
    def words(self) -> list[str]:
        """The words of the command that choose it."""
        found = [self.board, *set_words(self.assignments), "--for", f"{self.for_s:g}"]
        if self.seed is not None:
            found += ["--seed", str(self.seed)]
        if self.within_s is not None:
            found += ["--within", f"{self.within_s:g}"]
        for each in self.without:
            found += ["--without", each]
        if self.pairs:
            found += ["--pairs", str(self.pairs)]
        return found


def span_faults(name: str, value_s: float | None) -> Iterator[str]:
    """Yield what is wrong with a time that may be left out."""
    if value_s is not None and not 0 < value_s <= _MOST_S:
        yield f"{name}: {value_s!r}; expected a positive number of seconds, {_MOST_S:g} at most"


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
