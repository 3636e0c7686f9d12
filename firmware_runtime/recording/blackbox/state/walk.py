"""The walk over a robot as it was built: which objects of it have state, in an order of their own.

It goes in breadth from the roots, through attributes, containers, tuples, frozen records, bound
methods, partials and closures, in the order in which these stand. So every process that builds the
same robot comes to the same objects by the same paths. What is met is one of

- a plain value, which has no state of its own;
- a holder: an object written in Python, whose state is what its attributes hold; or one that
  declares its state by `state` and `restore`; or the cell of a closure;
- a container, whose state is what it holds;
- a constant, such as a function, a tuple or a frozen record, which may lead to the former;
- an edge, which a replay has of its own: it is not looked into.

Anything else has state that cannot be told, and is refused by its path, unless what holds it
declares its state.
"""

import functools
import operator
import random
import re
import struct
import sys
import types
import weakref
from array import array
from collections import Counter, OrderedDict, defaultdict, deque
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from enum import Enum
from itertools import chain
from pathlib import PurePath
from threading import Lock, RLock
from typing import Any, Final, NamedTuple, TypeAlias

import msgspec

from firmware_runtime.devs.component import below_root
from firmware_runtime.devs.functions import Laps, Wrapped
from firmware_runtime.devs.model_errors import ModelError
from firmware_runtime.devs.ports import InPort, Listening, OutPort, Owner
from firmware_runtime.devs.simulator import Pool
from firmware_runtime.errors import ConfigError, Named
from firmware_runtime.recording.blackbox.state.attributes import attributes_of, written_classes
from firmware_runtime.recording.records import name_of, slots_of
from firmware_runtime.recording.values import GENERATORS

EXPECTED: Final = (
    "expected plain values (numbers, texts, tuples, lists, dicts, records) or a class that defines "
    "state() and restore(state)"
)
OTHER_ROBOT: Final = "it is of another robot; expected one of this board and these settings"


class UnkeepableState(ModelError, TypeError):
    """Something within a robot that cannot be kept in a file and set back."""

    def __init__(self, path: str, fault: str) -> None:
        self.path = path
        super().__init__(f"{path}: {fault}; {EXPECTED}")


class ForeignState(ConfigError):
    """A file's state that is none of this robot, or is damaged, or cannot be set back."""

    def __init__(self, fault: str) -> None:
        super().__init__("state", [fault], f"state: {fault}")

    @property
    def is_of_another_robot(self) -> bool:
        """Whether it is the state of other models."""
        return OTHER_ROBOT in self.faults


Thing: TypeAlias = Any
"""Any object: it is looked at, not used."""


class Found(NamedTuple):
    """An object with state."""

    path: str
    thing: Thing
    is_container: bool


def found_in(roots: Mapping[str, object], edges: Iterable[object]) -> list[Found]:
    """The objects that have state. Raises UnkeepableState for the first that cannot be kept."""
    walk = _Walk(edges)
    walk.from_roots(roots)
    return walk.found


def declares_state(thing: object) -> bool:
    """Whether an object says itself what its state is."""
    kind = type(thing)
    return all(callable(getattr(kind, name, None)) for name in ("state", "restore"))


def has_attributes(thing: object) -> bool:
    """Whether it has a dictionary of attributes."""
    return bool(type(thing).__dictoffset__)


CONTAINERS: Final = (list, dict, set, deque, bytearray, array, OrderedDict, defaultdict, Counter)
LOCKS: Final = (type(Lock()), type(RLock()))
"""Between two steps they are free."""
_PLUMBING: Final = (InPort, OutPort, Listening, Pool, Laps, Wrapped)
"""What the simulator is made of: it is empty between two steps."""
_STRUCTURE: Final = frozenset({"in_ports", "out_ports", "couplings"})
"""Of a component: no run changes it."""
_PLAIN: Final = frozenset({type(None), bool, int, float, complex, str, bytes, frozenset})
_LEAVES: Final = (
    *(type, types.ModuleType, Enum, PurePath, *LOCKS),
    *(range, slice, re.Pattern, struct.Struct, types.CodeType, types.EllipsisType),
    *(types.WrapperDescriptorType, types.MethodDescriptorType, types.ClassMethodDescriptorType),
    *(types.GenericAlias, types.UnionType, types.NotImplementedType),
    *(operator.attrgetter, operator.itemgetter, operator.methodcaller),
    *(msgspec.json.Encoder, msgspec.json.Decoder),
    *(msgspec.msgpack.Encoder, msgspec.msgpack.Decoder),
)
"""Constants that lead to nothing with state."""
_CACHED: Final = type(functools.lru_cache(len))


class _Walk:
    def __init__(self, edges: Iterable[object]) -> None:
        given = [*_PLUMBING, *edges]
        self.found: list[Found] = []
        self._edge_kinds = frozenset(each for each in given if isinstance(each, type))
        self._edges = {id(each): each for each in given if not isinstance(each, type)}
        self._seen: set[int] = set()
        self._passed: set[int] = set()
        """Containers that were met in what declares its state: their content is its business."""
        self._kept: list[Thing] = []
        """So that no number of an object is given to another one."""
        self._taken: dict[str, int] = {}

    def from_roots(self, roots: Mapping[str, object]) -> None:
        waiting = deque((thing, path, False) for path, thing in roots.items())
        while waiting:
            thing, path, is_declared = waiting.popleft()
            waiting.extend(self._visit(thing, path, is_declared=is_declared))

    def _visit(
        self, thing: Thing, path: str, *, is_declared: bool
    ) -> Iterable[tuple[Thing, str, bool]]:
        """What this leads to, and whether that is of an object that declares its state."""
        kind = type(thing)
        if kind in _PLAIN or id(thing) in self._seen or self._is_edge(thing):
            return ()
        if is_declared and kind in CONTAINERS:
            if id(thing) in self._passed:
                return ()
            self._passed.add(id(thing))
        else:
            self._seen.add(id(thing))
        self._kept.append(thing)
        if isinstance(thing, Owner):
            path = below_root(thing.path)
        parts = self._parts(thing, kind, path, is_declared=is_declared)
        within = declares_state(thing) if _is_object(thing, kind) else is_declared
        return ((part, f"{path}{step}", within) for step, part in parts)

    def _parts(
        self, thing: Thing, kind: type[Thing], path: str, *, is_declared: bool
    ) -> Iterator[tuple[str, Thing]]:
        if kind in CONTAINERS or _is_array(thing) or kind is random.Random:
            if not is_declared and _can_change(thing):
                self._add(path, thing, is_container=True)
            return _of_container(thing)
        if _is_generator_of_numpy(thing):
            self._add(path, thing, is_container=True)
            return iter(())
        if isinstance(thing, _LEAVES):
            return iter(())
        if (parts := _of_constant(thing, kind)) is not None:
            return parts
        if not _is_object(thing, kind):
            if is_declared:
                return iter(())
            raise UnkeepableState(path, f"a {name_of(kind)} has state that cannot be kept")
        if not _is_frozen(kind):
            self._add(path, thing, is_container=False)
        return _of_object(thing)

    def _add(self, path: str, thing: Thing, *, is_container: bool) -> None:
        count = self._taken[path] = self._taken.get(path, 0) + 1
        path = path if count == 1 else f"{path}.<{count}>"
        self.found.append(Found(path, thing, is_container))

    def _is_edge(self, thing: object) -> bool:
        # by inheritance: abstract classes take long to answer `isinstance`
        return id(thing) in self._edges or not self._edge_kinds.isdisjoint(type(thing).__mro__)


def _of_container(thing: Thing) -> Iterator[tuple[str, Thing]]:
    if isinstance(thing, dict):
        return ((f"[{key!r:.40}]", each) for key, each in thing.items())
    if isinstance(thing, list | deque):
        return ((f"[{place}]", each) for place, each in enumerate(thing))
    base = getattr(thing, "base", None)  # of an array of numpy, which may be a view of another
    return iter(() if base is None else ((".base", base),))


def _of_constant(thing: Thing, kind: type[Thing]) -> Iterator[tuple[str, Thing]] | None:  # noqa: C901, PLR0911 -- one for each
    """What a constant leads to; None for what is none."""
    if isinstance(thing, types.FunctionType):
        return _of_function(thing)
    if isinstance(thing, types.MethodType):
        return iter((("", thing.__self__), ("", thing.__func__)))
    if isinstance(thing, types.BuiltinFunctionType | types.MethodWrapperType):
        owner = thing.__self__
        return iter(() if owner is None else (("", owner),))
    if isinstance(thing, tuple):
        return ((f"[{place}]", each) for place, each in enumerate(tuple.__iter__(thing)))
    if isinstance(thing, functools.partial):
        named = ((f".{name}", each) for name, each in thing.keywords.items())
        return chain([("", thing.func)], _of_constant(thing.args, tuple) or (), named)
    if isinstance(thing, weakref.ref):
        return iter((("", thing()),))
    if isinstance(thing, types.MappingProxyType | Named):  # components, which no run changes
        return ((f"[{key!r:.40}]", each) for key, each in thing.items())
    if kind is memoryview:
        return iter((("", thing.obj),))
    if kind.__module__.partition(".")[0] == "numpy":
        if kind.__name__ == "Generator":
            return iter(((".bit_generator", thing.bit_generator),))
        return iter(()) if _is_constant_of_numpy(thing) else None
    if kind is _CACHED:
        return iter((("", thing.__wrapped__),))
    return None


def _of_function(function: types.FunctionType) -> Iterator[tuple[str, Thing]]:
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        yield f".<{name}>", cell
    yield from _of_constant(function.__defaults__ or (), tuple) or ()
    for name, each in (function.__kwdefaults__ or {}).items():
        yield f".{name}", each


def _of_object(thing: Thing) -> Iterator[tuple[str, Thing]]:
    if isinstance(thing, types.CellType):
        with suppress(ValueError):  # it is not filled
            yield "", thing.cell_contents
        return
    for name, slot in slots_of(type(thing)).items():
        try:
            yield f".{name}", slot.__get__(thing)
        except AttributeError:  # not set
            continue
    if has_attributes(thing):
        structure = _STRUCTURE if isinstance(thing, Owner) else ()
        for name, value in attributes_of(thing).items():
            if name not in structure:
                yield f".{name}", value


def _is_object(thing: Thing, kind: type[Thing]) -> bool:
    """Whether all that it holds are attributes and slots, and its class is none of Python's."""
    if kind is types.CellType:
        return True
    if kind.__module__.partition(".")[0] in sys.stdlib_module_names:
        return False
    if isinstance(thing, msgspec.Struct):
        return True
    return written_classes(kind) is not None


def _is_frozen(kind: type[Thing]) -> bool:
    settings = getattr(kind, "__struct_config__", None)
    parameters = vars(kind).get("__dataclass_params__")
    return getattr(settings, "frozen", False) or getattr(parameters, "frozen", False)


def _is_array(thing: Thing) -> bool:
    kind = type(thing)
    return kind.__module__ == "numpy" and kind.__name__ == "ndarray" and not thing.dtype.hasobject


def _can_change(thing: Thing) -> bool:
    return not _is_array(thing) or bool(thing.flags.writeable)


def _is_generator_of_numpy(thing: Thing) -> bool:
    kind = type(thing)
    return kind.__module__.partition(".")[0] == "numpy" and kind.__name__ in GENERATORS


def _is_constant_of_numpy(thing: Thing) -> bool:
    numpy: Any = sys.modules["numpy"]
    return isinstance(thing, numpy.generic | numpy.dtype | numpy.ufunc)
