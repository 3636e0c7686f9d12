"""Classes of what was sent: what MessagePack does not say of a value, such as a list for a tuple.

A value's *word* names its class and those within it: `robot:Forces(up=_, names=list[str])`. What
the written form tells by itself, a float, a truth value or None, is `_`; a sequence of nothing else
has no brackets. A class of which not all is written, such as one with attributes beside its fields,
ends with `?`: of such a value nothing can be said to be the same.

A run notes words as they change (`NotedClasses`), a number for one it has noted before. To keep a
step short it looks at a record and its fields, and into what these hold only where there is more
than numbers; the word of one that it does not look into begins with `~`.
"""

import types
from array import array
from collections import OrderedDict, deque
from collections.abc import Callable, Container, Mapping, Sequence
from datetime import date, timedelta
from decimal import Decimal
from enum import Enum
from operator import attrgetter
from typing import Any, Final, TypeAlias
from uuid import UUID

import msgspec

Word: TypeAlias = str
Tree: TypeAlias = Any
"""A class, or a tuple of one and what is within."""

UNSURE: Final = "?"
SHALLOW: Final = "~"
MOST_WORDS: Final = 1000
"""A run that sends values of more kinds than this has no words for the others."""
NO_WORD: Final = "?"
FREE: Final = "_"

_FREE: Final = frozenset({float, bool, type(None)})
_LEAVES: Final = _FREE | {
    *(int, str, bytes, bytearray, complex, array),
    *(Decimal, UUID, date, timedelta),
}
_SEQUENCES: Final = (tuple, list, deque)
_MAPS: Final = frozenset({dict, OrderedDict})
_DEEPEST: Final = 40
_MOST_ITEMS: Final = 100
"""Of a collection of values of several classes; of one with more no word is kept."""


def word_of(value: object) -> tuple[Word, Word]:
    """The word of a value, and as a run notes it that looks at a record and its fields alone."""
    tree = _tree(value)
    return _text(tree), _text(tree, 1)


class Found(Enum):
    """What the classes of a value are, beside those that were noted."""

    SAME = 1
    OTHER = 2
    UNSURE = 3
    """They do not differ as far as is known."""


def compare_classes(noted: Word | None, value: object) -> tuple[Found, Word]:
    """Compare the classes of a value with what was noted; its word."""
    word, in_short = word_of(value)
    if noted is None or noted == NO_WORD:
        return (Found.SAME if word == FREE else Found.UNSURE), word
    kept = noted.removeprefix(SHALLOW)
    if kept == word:
        return (Found.UNSURE if UNSURE in word else Found.SAME), word
    is_unseen = kept != noted and kept == in_short
    return (Found.UNSURE if is_unseen else Found.OTHER), word


class NotedClasses:
    """Notes the words of what a run sends, section by section.

    `note` returns what is to be noted of a section, in turns: a place among its values, and the
    word that its port has from there on; the number of one that has been noted before.
    """

    def __init__(self) -> None:
        self.skipped: Container[int] = ()
        """Ports of which nothing is noted: a world's, whose values are played back."""
        self._numbers: dict[Word, int] = {}
        self._last: dict[int, tuple[type, _Look | None, Any]] = {}
        self._words: dict[int, Word] = {}

    def note(self, sent: Sequence[Any]) -> list[Any] | None:
        """See the class; None for a section of which there is nothing to note."""
        found: list[Any] | None = None
        last, skipped = self._last, self.skipped
        place = -1
        parts = iter(sent)
        for port in parts:
            place += 1
            value = next(parts)
            if port in skipped:
                continue
            try:
                kind, look, seen = last[port]
                if kind is type(value) and (look is None or look(value) == seen):
                    continue
            except Exception:  # noqa: BLE001, S110 -- a new port, or of a class of the model's
                pass
            word = self._look_at(port, value)
            if self._words.get(port) != word:
                self._words[port] = word
                found = [] if found is None else found
                found += place, self._number(word)
        return found

    def state(self) -> dict[str, Any]:
        """All that has been noted, for a reader that begins here."""
        return _state(self._numbers, self._words)

    def _number(self, word: Word) -> int | Word:
        number = self._numbers.get(word)
        if number is None:
            self._numbers[word] = len(self._numbers)
            return word
        return number

    def _look_at(self, port: int, value: object) -> Word:
        """Look at a value as a whole; how the next one of its port is looked at follows."""
        kind = type(value)
        try:
            tree = _tree(value)
            look = _look_for(kind, tree)
            self._last[port] = kind, look, None if look is None else look(value)
            word = _text(tree)
        except Exception:  # noqa: BLE001 -- of a class of the model's
            self._last.pop(port, None)
            return NO_WORD
        if look is not None and look is not _tree:
            word = f"{SHALLOW}{word}"
        is_known = word in self._numbers or len(self._numbers) < MOST_WORDS
        return word if is_known else NO_WORD


class ReadClasses:
    """The words of what a recording has, section by section. Raises ValueError for what is none."""

    def __init__(self) -> None:
        self._words: list[Word] = []
        self._ports: dict[int, Word] = {}

    def restart(self, state: Any) -> None:  # noqa: ANN401 -- what is in a file
        """Begin with what was noted up to here, as `NotedClasses.state` has it."""
        try:
            found = msgspec.convert(state, _State)
            self._words = found.words
            self._ports = {port: found.words[number] for port, number in found.ports}
        except (msgspec.ValidationError, IndexError) as error:
            raise ValueError(f"classes of values: {error}") from error

    def state(self) -> dict[str, Any]:
        """As `NotedClasses.state`."""
        return _state({word: number for number, word in enumerate(self._words)}, self._ports)

    def read(self, ports: Sequence[int], noted: Any) -> list[Word | None]:  # noqa: ANN401 -- as above
        """The words of a section's values, which left these ports; None where none was noted."""
        changes = self._changes(noted, len(ports))
        found = []
        for place, port in enumerate(ports):
            if place in changes:
                self._ports[port] = changes[place]
            found.append(self._ports.get(port))
        return found

    def _changes(self, noted: Any, count: int) -> dict[int, Word]:  # noqa: ANN401 -- as above
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

    def _word(self, word: Any) -> Word:  # noqa: ANN401 -- as above
        if isinstance(word, str):
            self._words.append(word)
            return word
        if type(word) is not int or not 0 <= word < len(self._words):
            raise ValueError(f"classes of values: {word!r} is no word")
        return self._words[word]


def _state(numbers: Mapping[Word, int], ports: Mapping[int, Word]) -> dict[str, Any]:
    at_ports = [[port, numbers[word]] for port, word in ports.items()]
    return {"words": [*numbers], "ports": at_ports}


class _State(msgspec.Struct):
    words: list[str]
    ports: list[tuple[int, int]]


_Look: TypeAlias = Callable[[Any], Any]


def _look_for(kind: type, tree: Tree) -> _Look | None:
    """What to look at of a value of this class, so that it is known to be as the last was."""
    if not isinstance(tree, tuple):
        return None if kind in _LEAVES or issubclass(kind, Enum) else _tree
    if tree in ((tuple,), (list,)):
        return _is_free
    names = field_names(kind)
    if not names or not all(map(_is_shallow, tree[1:])) or len(tree) != len(names) + 1:
        return _tree
    get = attrgetter(*(f"{name}.__class__" for name in names))
    if kind.__dictoffset__ == 0:
        return get
    count = _count_of_fields_in_dict(kind)
    return lambda value: (len(value.__dict__) == count, get(value))


def _is_free(items: Sequence[object]) -> bool:
    """Whether a collection has nothing but what its written form tells."""
    return _FREE.issuperset(map(type, items))


def _is_shallow(tree: Tree) -> bool:
    """Whether a field holds one thing, or a plain sequence of numbers."""
    return not isinstance(tree, tuple) or (len(tree) == 1 and tree[0] is not UNSURE)


def _tree(value: object, depth: int = 0) -> Tree:
    kind = type(value)
    if kind in _LEAVES:
        return kind
    if issubclass(kind, Enum):
        return kind
    if kind in _SEQUENCES and depth <= _DEEPEST:
        return _of_items(kind, value, depth)
    if depth > _DEEPEST or not _is_whole(kind, value):
        return (kind, UNSURE)
    return _of_whole(kind, value, depth)


def _of_whole(kind: type[Any], value: Any, depth: int) -> Tree:  # noqa: ANN401 -- any value
    if (names := field_names(kind)) is not None:
        return (kind, *(_tree(getattr(value, name), depth + 1) for name in names))
    if issubclass(kind, _SEQUENCES):
        return _of_items(kind, value, depth)
    if issubclass(kind, set | frozenset):
        tree = _of_items(kind, value, depth)
        return tree if len(tree) <= 2 else (kind, UNSURE)  # a set has no order
    if issubclass(kind, dict):
        pairs = (dict.keys(value), dict.values(value))
        return (kind, *(_of_items(tuple, [*each], depth) for each in pairs))
    return kind  # of numpy, whose form says what it is


def _of_items(kind: type, items: Any, depth: int) -> Tree:  # noqa: ANN401 -- any collection
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


def field_names(kind: type[Any]) -> Sequence[str] | None:
    """The fields of a record: a named tuple, Struct or dataclass; None of another class."""
    if issubclass(kind, tuple):
        names: Sequence[str] | None = getattr(kind, "_fields", None)
        return names
    if issubclass(kind, msgspec.Struct):
        return kind.__struct_fields__
    of_dataclass: dict[str, Any] | None = getattr(kind, "__dataclass_fields__", None)
    if of_dataclass is None:
        return None
    from dataclasses import fields  # noqa: PLC0415 -- not every robot has some

    return tuple(each.name for each in fields(kind))


def _is_whole(kind: type[Any], value: Any) -> bool:  # noqa: ANN401 -- any value
    """Whether fields and items are all that a value has."""
    if kind.__module__.partition(".")[0] == "numpy" and hasattr(kind, "tobytes"):
        is_plain = kind.__name__ == "ndarray" or not hasattr(kind, "__array_finalize__")
        return is_plain and value.dtype.names is None and not value.dtype.hasobject
    names = field_names(kind) or ()
    is_known = bool(names) or issubclass(kind, msgspec.Struct | tuple)
    if not is_known and hasattr(kind, "__dataclass_fields__"):
        is_known = True
    if not is_known and not _is_collection(kind):
        return False
    if kind.__dictoffset__ != 0 and len(value.__dict__) != _count_of_fields_in_dict(kind):
        return False
    return not any(
        type(each) is types.MemberDescriptorType and name not in names
        for base in kind.__mro__
        for name, each in vars(base).items()
    )


def _is_collection(kind: type[Any]) -> bool:
    if kind in _MAPS or kind in (list, set, frozenset):
        return True
    return issubclass(kind, list | set | frozenset) or (
        issubclass(kind, dict) and kind.__base__ is dict and kind.__module__ != "collections"
    )


def _count_of_fields_in_dict(kind: type[Any]) -> int:
    """How many of a record's fields are in the `__dict__` of each."""
    if issubclass(kind, tuple | msgspec.Struct) or not hasattr(kind, "__dataclass_fields__"):
        return 0
    slots = {
        name
        for base in kind.__mro__
        for name, each in vars(base).items()
        if type(each) is types.MemberDescriptorType
    }
    return len([name for name in field_names(kind) or () if name not in slots])


def _text(tree: Tree, depth: int = _DEEPEST + 3) -> Word:
    if not isinstance(tree, tuple):
        return _name(tree)
    kind, *within = tree
    if within == [UNSURE]:
        return f"{_name(kind)}{UNSURE}"
    if depth == 0 or not within:
        return _name(kind)
    names = field_names(kind)
    texts = [_text(each, depth - 1) for each in within]
    if names is not None and len(names) == len(texts):
        return f"{_name(kind)}({', '.join(map('='.join, zip(names, texts, strict=True)))})"
    return f"{_name(kind)}[{', '.join(texts)}]"


def _name(kind: type) -> str:
    if kind in _FREE:
        return FREE
    if kind.__module__ == "builtins":
        return kind.__qualname__
    return f"{kind.__module__}:{kind.__qualname__}"
