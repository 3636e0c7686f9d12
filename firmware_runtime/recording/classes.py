"""Classes of what was sent: what MessagePack does not say of a value, such as a list for a tuple.

A value's *word* names its class and those within it: `robot:Forces(up=_, names=list[str])`. What
the written form tells by itself, a float, a truth value or None, is `_`; a sequence of nothing else
has no brackets. A class of which not all is written, such as one with attributes beside its fields,
ends with `?`: of such a value nothing can be said to be the same.

A run notes words as they change (`NotedClasses`), a number for one it has noted before. To keep a
step short it looks at a record and its fields, and into what these hold only where there is more
than numbers; the word of one that it does not look into begins with `~`. What cannot be changed is
looked at by the port that sends it, all else when the step is over, as it is written then.
"""

from array import array
from collections import OrderedDict, deque
from collections.abc import Callable, Collection, Container, Mapping, Sequence
from datetime import date, timedelta
from decimal import Decimal
from enum import Enum
from operator import attrgetter
from typing import Any, Final, TypeAlias
from uuid import UUID

import msgspec

from firmware_runtime.devs.ports import OutPort, Sent
from firmware_runtime.recording.records import (
    UnknownValue,
    is_record,
    name_of,
    record_of,
    slots_of,
)

Word: TypeAlias = str
Tree: TypeAlias = Any
"""A class, or a tuple of one and what is within."""

UNSURE: Final = "?"
SHALLOW: Final = "~"
MOST_WORDS: Final = 1000
"""A run that sends values of more kinds than this has no words for the others."""
NO_WORD: Final = "?"
FREE: Final = "_"

_FREE: Final[frozenset[type[Any]]] = frozenset({float, bool, type(None)})
_LEAVES: Final = _FREE | {
    *(int, str, bytes, bytearray, complex, array),
    *(Decimal, UUID, date, timedelta),
}
_SEQUENCES: Final = (tuple, list, deque)
_PLAIN_COLLECTIONS: Final = frozenset({*_SEQUENCES, set, frozenset, dict, OrderedDict})
_DEEPEST: Final = 40
_MOST_ITEMS: Final = 100
"""Most items of a collection of values of several classes that are named in a word."""


def compare_classes(noted: Word | None, value: object) -> tuple[bool | None, Word]:
    """Return whether a value has the classes that were noted, and its word.

    None where they do not differ as far as is known.
    """
    tree = _tree(value)
    word = _text(tree)
    if noted is None or noted == NO_WORD:
        return (True if word == FREE else None), word
    kept = noted.removeprefix(SHALLOW)
    if kept == word:
        return (None if UNSURE in word else True), word
    is_unseen = kept != noted and kept == _text(tree, 1)
    return (None if is_unseen else False), word


class NotedClasses:
    """Notes the words of what a run sends, section by section.

    A port appends to `unlike` what may have another word than its last value (`devs.ports`).
    """

    def __init__(self, sent: Sent) -> None:
        self.unlike: list[Any] = []
        self.skipped: Container[int] = ()
        """Ports of which nothing is noted: a world's, whose values are played back."""
        self._sent = sent
        self._numbers: dict[Word, int] = {}
        self._words: dict[int, Word] = {}
        self._last: dict[int, tuple[type, _Look, object]] = {}
        """Values to look at when a step is over, by port: class, look, and what was seen."""

    def note(self) -> list[object] | None:
        """Return what is to be noted of the section, in turns; None where there is nothing.

        A place among its values, and the word that its port has from there on; the number of one
        that has been noted before.
        """
        found: list[object] = []
        parts = iter(self.unlike)
        for port in parts:
            place = next(parts)
            value = self._sent[place]
            try:
                kind, look, seen = self._last[port.number]
                if type(value) is kind and look(value) == seen:
                    continue
            except Exception:  # noqa: BLE001, S110 -- a new port, or of a class of the model's
                pass
            if port.number in self.skipped:
                port.kind = type(value)
                continue
            word = self._look_at(port, value)
            if self._words.get(port.number) != word:
                self._words[port.number] = word
                found += place // 2, self._number(word)
        self.unlike.clear()
        return found or None

    def state(self) -> dict[str, Any]:
        """All that has been noted, for a reader that begins here."""
        return _state(self._numbers, self._words)

    def _number(self, word: Word) -> int | Word:
        number = self._numbers.get(word)
        if number is None:
            self._numbers[word] = len(self._numbers)
            return word
        return number

    def _look_at(self, port: OutPort[Any], value: object) -> Word:
        """Look at a value as a whole; how the next one of its port is looked at follows."""
        kind = type(value)
        port.kind = port.look = port.leaves = None
        self._last.pop(port.number, None)
        try:
            tree = _tree(value)
            look = _look_for(kind, tree)
            seen = None if look is None else look(value)
            word = _text(tree)
        except Exception:  # noqa: BLE001 -- of a class of the model's
            return NO_WORD
        if kind is tuple and look is _is_free:
            port.kind, port.leaves = kind, _FREE  # as that, without the call
        elif look is None or (look is not _tree and not _can_change(kind)):
            port.kind, port.look, port.seen = kind, look, seen
        else:
            self._last[port.number] = kind, look, seen
        if look is not None and look is not _tree:
            word = f"{SHALLOW}{word}"
        is_known = word in self._numbers or len(self._numbers) < MOST_WORDS
        return word if is_known else NO_WORD


class ReadClasses:
    """The words of what a recording has, section by section. Raises ValueError for what is none."""

    def __init__(self) -> None:
        self._words: list[Word] = []
        self._ports: dict[int, Word] = {}

    def restart(self, state: object) -> None:
        """Begin with what was noted up to here, as `NotedClasses.state` has it."""
        try:
            found = msgspec.convert(state, _State)
            self._words = found.words
            self._ports = {port: found.words[number] for port, number in found.ports}
        except (msgspec.ValidationError, IndexError) as error:
            raise ValueError(f"classes of values: {error}") from error

    def state(self) -> dict[str, object]:
        """As `NotedClasses.state`."""
        return _state({word: number for number, word in enumerate(self._words)}, self._ports)

    def read(self, ports: Sequence[int], noted: object) -> list[Word | None]:
        """The words of a section's values, which left these ports; None where none was noted."""
        changes = self._changes(noted, len(ports))
        found = []
        for place, port in enumerate(ports):
            if place in changes:
                self._ports[port] = changes[place]
            found.append(self._ports.get(port))
        return found

    def _changes(self, noted: object, count: int) -> dict[int, Word]:
        if noted is None:
            return {}
        if not isinstance(noted, list) or len(noted) % 2 != 0:
            raise ValueError("classes of values: expected places and words in turns")
        changes = {}
        for place, word in zip(noted[::2], noted[1::2], strict=True):
            if type(place) is not int or not 0 <= place < count:
                raise ValueError(f"classes of values: {place!r} is no place of a value")
            changes[place] = self._word(word)
        return changes

    def _word(self, word: object) -> Word:
        if isinstance(word, str):
            self._words.append(word)
            return word
        if type(word) is not int or not 0 <= word < len(self._words):
            raise ValueError(f"classes of values: {word!r} is no word")
        return self._words[word]


def _state(numbers: Mapping[Word, int], ports: Mapping[int, Word]) -> dict[str, object]:
    at_ports = [[port, numbers[word]] for port, word in ports.items()]
    return {"words": [*numbers], "ports": at_ports}


class _State(msgspec.Struct):
    words: list[str]
    ports: list[tuple[int, int]]


_Look: TypeAlias = Callable[[Any], object]


def _look_for(kind: type[object], tree: Tree) -> _Look | None:
    """Return what tells that a value of this class is as the last was; None for the class alone."""
    if _is_all_said(kind):
        return None
    if tree in ((tuple,), (list,)):
        return _is_free
    if not is_record(kind) or len(tree) == 1 or not all(map(_is_shallow, tree[1:])):
        return _tree
    record = record_of(kind)
    if kind.__dictoffset__ != 0:
        return lambda value: [type(each) for each in record.values_of(value)]
    return attrgetter(*(f"{name}.__class__" for name in record.names))


def _can_change(kind: type[object]) -> bool:
    """Return whether what a value holds can be another when the step is over, or be missing."""
    is_frozen = issubclass(kind, msgspec.Struct) and kind.__struct_config__.frozen
    return not is_frozen and not issubclass(kind, tuple)


def _is_free(items: Sequence[object]) -> bool:
    """Return whether a collection has nothing but what its written form tells."""
    return _FREE.issuperset(map(type, items))


def _is_shallow(tree: Tree) -> bool:
    """Return whether a field holds one thing, or a plain sequence of numbers."""
    return not isinstance(tree, tuple) or (len(tree) == 1 and tree[0] is not UNSURE)


def _is_all_said(kind: type[object]) -> bool:
    return kind in _LEAVES or issubclass(kind, Enum)


def _tree(value: object, depth: int = 0) -> Tree:
    kind = type(value)
    if _is_all_said(kind):
        return kind
    if depth > _DEEPEST:
        return (kind, UNSURE)
    if is_record(kind):
        try:
            return (kind, *(_tree(each, depth + 1) for each in record_of(kind).values_of(value)))
        except UnknownValue:  # it has attributes that are no field
            return (kind, UNSURE)
    if kind.__module__.partition(".")[0] == "numpy":
        return kind if _is_of_numbers(kind, value) else (kind, UNSURE)
    return _of_collection(kind, value, depth) if _is_whole(kind, value) else (kind, UNSURE)


def _is_of_numbers(kind: type[object], value: Any) -> bool:  # noqa: ANN401 -- of numpy
    """Return whether the form of an array, or a number, says what it is."""
    is_plain = kind.__name__ == "ndarray" or not hasattr(kind, "__array_finalize__")
    is_known = is_plain and hasattr(kind, "tobytes")
    return is_known and value.dtype.names is None and not value.dtype.hasobject


def _is_whole(kind: type[object], value: object) -> bool:
    """Return whether it is a collection whose items are all that it has."""
    if kind in _PLAIN_COLLECTIONS:
        return True
    is_one = issubclass(kind, tuple | list | set | frozenset) or kind.__base__ is dict
    if not is_one or kind.__module__ == "collections" or slots_of(kind):
        return False
    return kind.__dictoffset__ == 0 or not vars(value)


def _of_collection(kind: type[object], value: Any, depth: int) -> Tree:  # noqa: ANN401 -- any
    if issubclass(kind, dict):
        pairs = (dict.keys(value), dict.values(value))
        return (kind, *(_of_items(tuple, [*each], depth) for each in pairs))
    tree = _of_items(kind, value, depth)
    has_order = issubclass(kind, _SEQUENCES)
    return tree if has_order or len(tree) <= 2 else (kind, UNSURE)


def _of_items(kind: type, items: Collection[object], depth: int) -> Tree:
    """The class of a collection, with that of its items if it is one, else with each one's."""
    kinds = {*map(type, items)}
    if kinds <= _FREE:
        return (kind,)
    if kinds <= _LEAVES and len(named := kinds - _FREE) == 1:
        return (kind, *named)
    trees = [_tree(each, depth + 1) for each in items]
    if len(named := {each for each in trees if each not in _FREE}) == 1:
        return (kind, *named)
    if len(trees) > _MOST_ITEMS:
        return (kind, UNSURE)
    return (kind, *(float if each in _FREE else each for each in trees))


def _text(tree: Tree, depth: int = _DEEPEST + 3) -> Word:
    if not isinstance(tree, tuple):
        return _name(tree)
    kind, *within = tree
    if within == [UNSURE]:
        return f"{_name(kind)}{UNSURE}"
    if depth == 0 or not within:
        return _name(kind)
    texts = [_text(each, depth - 1) for each in within]
    if is_record(kind):
        names = record_of(kind).names
        return f"{_name(kind)}({', '.join(map('='.join, zip(names, texts, strict=True)))})"
    return f"{_name(kind)}[{', '.join(texts)}]"


def _name(kind: type) -> str:
    if kind in _FREE:
        return FREE
    return kind.__qualname__ if kind.__module__ == "builtins" else name_of(kind)
