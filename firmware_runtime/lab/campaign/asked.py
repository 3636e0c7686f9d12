"""What a rig is asked while its robot is judged: outputs, the world's truth, oracles of its own.

Whatever it raises is the fault of its package, and no finding.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import isfinite
from typing import Final, TypeAlias, cast

import msgspec
from msgspec import Struct

from firmware_runtime.board.registry import Board
from firmware_runtime.board.rig import Driven, Noted, Rig
from firmware_runtime.board.rigs import blamed_on_rig
from firmware_runtime.board.strict import shown
from firmware_runtime.errors import ConfigError, SettingError, text_of
from firmware_runtime.lab.campaign.verdict import where_raised

Oracle: TypeAlias = Callable[[Rig], str | None]
"""An oracle of one's own: a sentence about what is wrong with a rig's world now, or None."""
Method: TypeAlias = Callable[[], object]
ANSWERS: Final = ("truth", "judge", "missed", "lost", "restore", "is_driven")
"""What a rig can be asked beside its outputs, where it has it."""


class Asked:
    """A rig that may answer, and may be silent; all raise ConfigError where it raises.

    Its truth is the same finite numbers whenever it is asked.
    """

    def __init__(self, rig: Rig, board: Board, oracle: Oracle | None = None) -> None:
        self._rig = rig
        self._oracle = oracle
        self._board = board
        # by name: to look at a protocol asks a property for its value
        self._driven = cast("Driven", rig) if "is_driven" in dir(rig) else None
        self._truth = self._method("truth")
        self._lost = self._method("lost")
        self._judge = self._method("judge")
        self._missed = self._method("missed")
        self._restore = self._method("restore")
        lines = [*rig.buses.values(), *rig.ports.values()]
        self._noted = [line for line in lines if isinstance(line, Noted)]
        with blamed_on_rig(board, "truth"):
            values = dict(self._values())
        with blamed_on_rig(board, "outputs"):
            _check_outputs(rig.outputs)
        self.answers = tuple(each for each in ANSWERS if each in dir(rig))
        """What it can be asked beside its outputs."""
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
            said: object = self._driven.is_driven
            if not isinstance(said, bool):
                raise SettingError(f"is_driven {shown(said)}", expected="True or False")
            return said

    def levels(self, at: int) -> tuple[float, ...]:
        """Return how each output stands at an instant of its clock, ns."""
        with blamed_on_rig(self._board, "levels"):
            return tuple(map(float, self._rig.levels(at).values()))

    def lost(self) -> str | None:
        """Return why its robot cannot go on; None while it can, or where it does not know."""
        return self._sentence("lost", self._lost)

    def judged(self) -> str | None:
        """Return what is wrong with its world by its own oracle, or the campaign's; else None."""
        said = self._sentence("judge", self._judge)
        return self._by_the_campaign() if said is None else said

    def missed(self) -> str | None:
        """Return what its robot should have done by now and has not; None for nothing."""
        return self._sentence("missed", self._missed)

    def restore(self) -> bool:
        """Put its robot back where it began, as somebody does who finds it; False if it cannot."""
        if self._restore is None:
            return False
        with blamed_on_rig(self._board, "restore"):
            self._restore()
        return True

    @property
    def notes(self) -> list[str]:
        """What doubles have noted: what a real chip would ignore, refuse or leave undefined."""
        return [each for line in self._noted for each in line.warnings]

    def _values(self) -> Mapping[str, object]:
        if self._truth is None:
            return {}
        found = self._truth()
        if not isinstance(found, Mapping):
            raise SettingError(f"truth() {shown(found)}", expected="values by their names")
        return found

    def _sentence(self, part: str, method: Method | None) -> str | None:
        if method is None:
            return None
        with blamed_on_rig(self._board, part):
            found = method()
            if found is None or isinstance(found, str):
                return found
            raise SettingError(f"{part}() {shown(found)}", expected="a sentence or None")

    def _by_the_campaign(self) -> str | None:
        if self._oracle is None:
            return None
        try:
            found: object = self._oracle(self._rig)
        except Exception as error:
            fault = f"judge: {type(error).__name__}: {text_of(error)} ({where_raised(error)})"
            raise ConfigError.of_one("campaign", fault) from error
        if found is None or isinstance(found, str):
            return found
        raise ConfigError.of_one("campaign", f"judge: {shown(found)}", "a sentence or None")

    def _method(self, part: str) -> Method | None:
        if part not in dir(self._rig):
            return None
        with blamed_on_rig(self._board, part):
            method: object = getattr(self._rig, part)
            if callable(method):
                return method
            raise SettingError(f"{part} {shown(method)}", expected="a method")


def _check_outputs(outputs: Mapping[str, object]) -> None:
    for name, on in outputs.items():
        if not isinstance(on, int):
            raise SettingError(f"{name} {shown(on)}", expected="how many of its outputs are on")


def _all_numbers(values: Mapping[str, object]) -> list[tuple[str, float]]:
    return [each for path, value in values.items() for each in _numbers(path, value)]


def _numbers(name: str, value: object) -> Iterator[tuple[str, float]]:
    """The numbers in a value, each with its name. Raises SettingError for what has none."""
    if isinstance(value, int | float):
        yield name, float(value)
    elif isinstance(value, Sequence) and not isinstance(value, str | bytes):
        for index, each in enumerate(value):
            yield from _numbers(f"{name}.{index}", each)
    elif isinstance(value, Struct):
        for field, each in msgspec.structs.asdict(value).items():
            yield from _numbers(f"{name}.{field}", each)
    else:
        raise SettingError(f"{name} is {shown(value)}", expected="a number, or some")
