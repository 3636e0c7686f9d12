"""What a rig is asked while its robot is judged: outputs, the world's truth, oracles of its own.

Whatever it raises is the fault of its package, and no finding.
"""

from collections.abc import Iterator, Mapping, Sequence
from math import isfinite

import msgspec
from msgspec import Struct

from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Driven, Judging, Losable, Noted, Purposeful, Rig, Truthful
from firmware_runtime.board.rigs import blamed_on_rig
from firmware_runtime.errors import SettingError


class Asked:
    """A rig that may answer, and may be silent; all raise ConfigError where it raises.

    Its truth is the same finite numbers whenever it is asked.
    """

    def __init__(self, rig: Rig, board: Board) -> None:
        self._rig = rig
        self._board = board
        # asked once: to look at a protocol takes longer than to look at the robot
        self._truth = rig if isinstance(rig, Truthful) else None
        self._driven = rig if isinstance(rig, Driven) else None
        self._losable = rig if isinstance(rig, Losable) else None
        self._judging = rig if isinstance(rig, Judging) else None
        self._purposeful = rig if isinstance(rig, Purposeful) else None
        lines = [*rig.buses.values(), *rig.ports.values()]
        self._noted = [line for line in lines if isinstance(line, Noted)]
        with blamed_on_rig(board, "truth"):
            values = dict(self._values().items())
        self.ports = frozenset(values)
        """Paths of ports whose values its truth has."""
        self.names = [name for name, _ in _all_numbers(values)]
        """Names of the numbers of its truth."""

    def numbers(self) -> tuple[float, ...]:
        """Return the numbers of its truth now, in the order of their names."""
        with blamed_on_rig(self._board, "truth"):
            found = _all_numbers(self._values())
            if [name for name, _ in found] != self.names:
                expected = f"as at first, {', '.join(self.names)}"
                raise SettingError(", ".join(name for name, _ in found), expected=expected)
            for name, number in found:
                if not isfinite(number):
                    raise SettingError(f"{name} is {number}", expected="a finite number")
        return tuple(number for _, number in found)

    @property
    def outputs(self) -> dict[str, int]:
        """How many outputs of each actuating chip are on."""
        with blamed_on_rig(self._board, "outputs"):
            return dict(self._rig.outputs.items())

    @property
    def has_output_on(self) -> bool:
        """Whether any output is on."""
        return any(self.outputs.values())

    @property
    def is_driven(self) -> bool:
        """Whether outputs move something; any that is on, where it does not say that."""
        if self._driven is None:
            return self.has_output_on
        with blamed_on_rig(self._board, "is_driven"):
            return self._driven.is_driven

    def levels(self, at: int) -> tuple[float, ...]:
        """Return how each output stands at an instant of its clock, ns."""
        with blamed_on_rig(self._board, "levels"):
            return tuple(map(float, self._rig.levels(at).values()))

    def lost(self) -> str | None:
        """Return why its robot cannot go on; None while it can, or where it does not know."""
        if self._losable is None:
            return None
        with blamed_on_rig(self._board, "lost"):
            return self._losable.lost()

    def judged(self) -> str | None:
        """Return what is wrong with its world by its own oracle; None for nothing, or no oracle."""
        if self._judging is None:
            return None
        with blamed_on_rig(self._board, "judge"):
            return self._judging.judge()

    def missed(self) -> str | None:
        """Return what its robot should have done by now and has not; None for nothing."""
        if self._purposeful is None:
            return None
        with blamed_on_rig(self._board, "missed"):
            return self._purposeful.missed()

    @property
    def notes(self) -> list[str]:
        """What doubles have noted: what a real chip would ignore, refuse or leave undefined."""
        return [each for line in self._noted for each in line.warnings]

    def _values(self) -> Mapping[str, object]:
        return {} if self._truth is None else self._truth.truth()


def _all_numbers(values: Mapping[str, object]) -> list[tuple[str, float]]:
    return [each for path, value in values.items() for each in _numbers(path, value)]


def _numbers(name: str, value: object) -> Iterator[tuple[str, float]]:
    """The numbers in a value, each with its name."""
    if isinstance(value, int | float):
        yield name, float(value)
    elif isinstance(value, Sequence) and not isinstance(value, str | bytes):
        for index, each in enumerate(value):
            yield from _numbers(f"{name}.{index}", each)
    elif isinstance(value, Struct):
        for field, each in msgspec.structs.asdict(value).items():
            yield from _numbers(f"{name}.{field}", each)
