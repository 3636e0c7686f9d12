"""The objects of a robot, numbered in an order that is the same in every process that builds it.

The graph is walked in breadth from the roots: content, slots and attributes in their order, the
cells of closures, what methods are bound to. A set has no order of its own: what only sets lead to
is numbered last, by its text.
"""

import zlib
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final

from firmware_runtime.blackbox.state.contents import is_array_of_objects
from firmware_runtime.blackbox.state.layouts import (
    ATOMS,
    ITERATORS,
    Thing,
    UnkeepableState,
    is_number_of_numpy,
    layout_of,
    parts_of,
)
from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.ports import InPort, OutPort, Owner


class KnownObjects:
    """`things` and their `paths`, by number; `number_of` finds one by its identity.

    `is_edge` says what is kept as it is: it has a number and no state, and is not looked into.
    Raises UnkeepableState, naming its path, for the first object that cannot be kept.
    """

    def __init__(self, roots: Mapping[str, object], is_edge: Callable[[object], bool]) -> None:
        self.things: list[Thing] = []
        self.paths: list[str] = []
        self._numbers: dict[int, int] = {}
        self._taken: dict[str, int] = {}
        """How many objects have, or were refused, a path."""
        self.with_state: list[int] = []
        """Numbers of those that have a state of their own."""
        self._is_edge = is_edge
        self._lines: list[str] = []
        """Path and class of each, or that it is an edge."""
        self._sets: list[tuple[Thing, str]] = []
        self._walk(deque((thing, name) for name, thing in roots.items()))
        while self._sets:
            self._walk(deque(self._only_in_sets()))
        self.modules = self._modules()
        """Those that hold a class or function of the robot, and Python's own mathematics."""

    @property
    def fingerprint(self) -> int:
        """The same for robots whose objects have the same classes and paths."""
        return zlib.crc32("\n".join(self._lines).encode())

    def _modules(self) -> frozenset[str]:
        owners = (thing if hasattr(thing, "__qualname__") else type(thing) for thing in self.things)
        names = (getattr(each, "__module__", None) for each in owners)
        return frozenset(each for each in names if each) - {"builtins"} | {"math", "operator"}

    def number_of(self, thing: object) -> int | None:
        """The number of an object; None for one that was made later, and for an atom."""
        return self._numbers.get(id(thing))

    def _walk(self, waiting: deque[tuple[Thing, str]]) -> None:
        while waiting:
            thing, path = waiting.popleft()
            kind = type(thing)
            if kind in ATOMS or id(thing) in self._numbers or is_number_of_numpy(thing):
                continue
            if not _WITH_PATHS.isdisjoint(kind.__mro__):
                path = below_root(thing.path)
            if kind not in ITERATORS:
                path = self._new_path(path)
                number = self._numbers[id(thing)] = len(self.things)
                self.things.append(thing)
                self.paths.append(path)
                if self._is_edge(thing):
                    self._lines.append(f"{path} edge")
                    continue
                layout = layout_of(kind)
                self._lines.append(f"{path} {layout.name}")
                if not layout.is_constant:
                    self.with_state.append(number)
            waiting.extend(self._parts(thing, path))

    def _new_path(self, path: str) -> str:
        """The path, with a number where another object has it: all that one partial leads to."""
        count = self._taken[path] = self._taken.get(path, 0) + 1
        return path if count == 1 else self._new_path(f"{path}.<{count}>")

    def _parts(self, thing: Thing, path: str) -> Iterator[tuple[Thing, str]]:
        layout = layout_of(type(thing))
        if not layout.is_sound and type(thing) not in ITERATORS:
            raise UnkeepableState(path, _strange(thing))
        if is_array_of_objects(thing):
            raise UnkeepableState(path, "an array of objects; expected a list, or one of numbers")
        if issubclass(layout.base, _SETS):
            self._sets.append((thing, path))
        for step, part in parts_of(thing):
            if type(part) not in ATOMS:
                if layout.is_constant:
                    _refuse_fixed(thing, part, f"{path}{step}")
                yield part, f"{path}{step}"
        if layout.kind is not layout.base:
            yield layout.kind, f"{path}.__class__"

    def _only_in_sets(self) -> Iterator[tuple[Thing, str]]:
        """What the sets found so far hold and nothing else led to, in an order of its own."""
        sets, self._sets = self._sets, []
        for thing, path in sets:
            new = [
                each for each in thing if type(each) not in ATOMS and id(each) not in self._numbers
            ]
            if len(new) == 1:
                yield new[0], f"{path}.<{type(new[0]).__name__}>"
                continue
            texts = {repr(each): each for each in new}
            if len(texts) < len(new) or any("0x" in text for text in texts):
                fault = f"a set of {type(new[0]).__name__}, in another order in every process"
                raise UnkeepableState(path, f"{fault}; expected a list, or names in the set")
            yield from ((texts[text], f"{path}.<{text:.40}>") for text in sorted(texts))


_SETS: Final = (set, frozenset)
_WITH_PATHS: Final = frozenset({Owner, InPort, OutPort})
"""What is called by its own path, however it was reached."""


def _refuse_fixed(holder: Thing, part: Thing, path: str) -> None:
    """An iterator is put back by another one; a holder that cannot be changed keeps the old one."""
    if type(part) in ITERATORS:
        fault = f"{type(part).__name__} within a {type(holder).__name__} cannot be set back"
        raise UnkeepableState(path, f"{fault}; expected it in an attribute")


def _strange(thing: object) -> str:
    kind = type(thing)
    return (
        f"a {kind.__module__}.{kind.__qualname__} cannot be kept and set back; expected numbers, "
        "texts, containers, arrays and objects made of these, or that it is declared an edge"
    )


def edges_of(given: Iterable[object]) -> Callable[[object], bool]:
    """Whether an object is an edge: one of those given, or of a class given."""
    given = list(given)
    kinds = {each for each in given if isinstance(each, type)}
    kept = {id(each): each for each in given if not isinstance(each, type)}

    def is_edge(thing: object) -> bool:
        # by inheritance: abstract classes take long to answer `isinstance`
        return id(thing) in kept or not kinds.isdisjoint(type(thing).__mro__)

    return is_edge
