"""Comparison of what a section's replay sent and counted with what is recorded."""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from itertools import zip_longest
from typing import Any, Final, TypeAlias

import msgspec
from msgspec import Struct

from firmware_runtime.devs.ports import Sent
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.section import (
    Kind,
    Section,
    encode_sent,
    pairs_of,
    sent_of,
)
from firmware_runtime.recording.classes import (
    SHALLOW,
    ReadClasses,
    Word,
    compare_classes,
)
from firmware_runtime.recording.replay.difference import NOTHING, Difference
from firmware_runtime.recording.values import unpack


def is_same_but_for_order(value: object, form: object) -> bool:
    """Return whether a value has this form, had its sets stood in that order."""
    if isinstance(value, set | frozenset):
        return isinstance(form, list | tuple) and _are_the_same(list(value), list(form))
    if isinstance(value, list | tuple):
        return isinstance(form, list | tuple) and _are_in_order(value, form)
    if isinstance(value, dict):
        if not isinstance(form, dict) or not _are_in_order([*value], [*form]):
            return False
        return _are_in_order([*value.values()], [*form.values()])
    if names := _fields_of(value):
        return _has_fields(value, form, names)
    return _written(value) == _written(form)


def _are_in_order(values: Sequence[object], forms: Sequence[object]) -> bool:
    pairs = zip(values, forms, strict=False)
    return len(values) == len(forms) and all(is_same_but_for_order(*pair) for pair in pairs)


def _are_the_same(values: Iterable[object], forms: list[object]) -> bool:
    """Return whether each value has a form of its own among these, and no form is left."""
    unmatched = []
    written = [_written(each) for each in forms]
    for value in values:
        content = _written(value)
        if content in written:
            written.remove(content)
        else:
            unmatched.append(value)
    left = [unpack(each)[1] for each in written]
    for value in unmatched:
        found = next((each for each in left if is_same_but_for_order(value, each)), None)
        if found is None:
            return False
        left.remove(found)
    return not left


def _has_fields(value: object, form: object, names: Mapping[str, str]) -> bool:
    """Return whether a record has this form, a map or a list; `names` are fields by name there."""
    present = unpack(_written(value))[1]
    if isinstance(present, dict) and isinstance(form, dict) and [*present] == [*form]:
        return all(
            is_same_but_for_order(getattr(value, names[key]), each)
            if key in names
            else present[key] == each
            for key, each in form.items()
        )
    if not isinstance(present, list) or not isinstance(form, list) or len(present) != len(form):
        return False
    tags = len(present) - len(names)  # one or none, and it stands first
    values = [getattr(value, name) for name in names.values()]
    return present[:tags] == form[:tags] and _are_in_order(values, form[tags:])


def _fields_of(value: object) -> dict[str, str]:
    if isinstance(value, Struct):
        return {each.encode_name: each.name for each in msgspec.structs.fields(value)}
    return {each.name: each.name for each in fields(value)} if is_dataclass(value) else {}


def _written(value: object) -> bytes:
    return encode_sent([0, value])


Pairs: TypeAlias = Sequence[tuple[int, object]]
"""Number of a port and value."""
Aligned: TypeAlias = Iterable[tuple[Any, Any]]
"""Places among what was recorded and what was replayed; None where there is none."""
Counts: TypeAlias = Mapping[str, Mapping[str, int]]
"""By model and what is counted."""

_MOST_NAMED: Final = 10


class ComparedValues:
    """Compares what left the robot's own ports with what is recorded, and counts it.

    A value is compared if its form says all of it and its classes are known. Values of a world are
    none of the robot's own: they are played back.
    """

    def __init__(self, ports: Sequence[str], played: frozenset[int]) -> None:
        self.values = 0
        """Own values that are recorded."""
        self.compared = 0
        """Own values that were compared as a whole, and are the same or differ."""
        self.played_back = 0
        self._ports = ports
        self.played = played
        self._noted: ReadClasses | None = ReadClasses()
        self._unsure: Counter[tuple[int, Word]] = Counter()

    def restart(self, state: object = None) -> None:
        """Go on where these classes had been noted; without any, classes are unknown for now."""
        self._noted = None
        if state is not None:
            self._noted = ReadClasses()
            try:
                self._noted.restart(state)
            except ValueError as error:
                raise _foreign(error) from error

    def state(self) -> dict[str, object] | None:
        """The classes that have been noted so far."""
        return None if self._noted is None else self._noted.state()

    def not_compared(self) -> Iterator[str]:
        """Yield what was not compared, a sentence for each port and class."""
        for (number, word), count in self._unsure.most_common(_MOST_NAMED):
            values = "1 value" if count == 1 else f"{count} values"
            yield f"{values} of {self.name(number)}: {word.removeprefix(SHALLOW)}"
        if len(self._unsure) > _MOST_NAMED:
            others = sum(count for _, count in self._unsure.most_common()[_MOST_NAMED:])
            yield f"{others} other values"

    def differences(self, section: Section, sent: Sent) -> Iterator[Difference]:
        """Values that are not the recorded ones, in order."""
        content, at = encode_sent(sent), section.at
        if content == bytes(section.sent) and self._are_all_same(sent[::2]):
            words = self._words(section, sent[::2])
            for number, value, word in zip(sent[::2], sent[1::2], words, strict=True):
                yield from self._compare_classes(at, number, word, value)
            return
        recorded, replayed, values = sent_of(section), pairs_of(unpack(content)), pairs_of(sent)
        words = self._words(section, [number for number, _ in recorded])
        for first, second in self._aligned(recorded, replayed):
            was = None if first is None else recorded[first]
            now = None if second is None else replayed[second]
            value = None if second is None else values[second][1]
            if self._is_same(at, was, now, value) and was is not None:
                yield from self._compare_classes(at, was[0], words[first], value)
                continue
            if was is not None:
                self._count(was[0])
            yield self._difference(at, was, now)

    def _are_all_same(self, _numbers: Sequence[int]) -> bool:
        """Return whether no more is to be looked at where all that was sent is the same."""
        return True

    def _aligned(self, recorded: Pairs, replayed: Pairs) -> Aligned:
        """Yield places of values that are to be the same: here in the order in which they left."""
        return zip_longest(range(len(recorded)), range(len(replayed)))

    def _is_same(self, _at: int, was: Any, now: Any, value: object) -> bool:  # noqa: ANN401 -- pairs
        if was is None or now is None:
            return False
        if encode_sent([*was]) == encode_sent([*now]):
            return True
        return bool(was[0] == now[0]) and is_same_but_for_order(value, was[1])

    def _difference(self, at: int, was: Any, now: Any) -> Difference:  # noqa: ANN401 -- pairs
        if was is not None and now is not None and was[0] != now[0]:
            now = None  # it sent from another port: what was sent then is missing
        model, _, port = self.name((was or now)[0]).rpartition(".")
        recorded = NOTHING if was is None else was[1]
        return Difference(at, "value", model, port, recorded, NOTHING if now is None else now[1])

    def _words(self, section: Section, numbers: Sequence[int]) -> list[Word | None]:
        """The word of each value of a section, as they left these ports."""
        if self._noted is None or section.kind is not Kind.STEP:
            return [None] * len(numbers)
        try:
            return self._noted.read(numbers, section.extra)
        except ValueError as error:
            raise _foreign(error) from error

    def _compare_classes(
        self, at: int, number: int, word: Word | None, value: object
    ) -> Iterator[Difference]:
        """Compare the classes of a value that has the form of the recorded one; count it."""
        if number in self.played:
            self.played_back += 1
            return
        self.values += 1
        is_same, now = compare_classes(word, value)
        if is_same is None:
            self._unsure[number, now] += 1
            return
        self.compared += 1
        if not is_same and word is not None:
            model, _, port = self.name(number).rpartition(".")
            yield Difference(at, "class", model, port, word.removeprefix(SHALLOW), now)

    def _count(self, number: int) -> None:
        """Count a recorded value that differs, or was not sent."""
        if number in self.played:
            self.played_back += 1
        else:
            self.values += 1
            self.compared += 1

    def name(self, number: int) -> str:
        """The path of a port; its number where the recording has none."""
        return self._ports[number] if 0 <= number < len(self._ports) else f"port {number}"


def differences_of_counts(at: int, recorded: Counts, replayed: Counts) -> Iterator[Difference]:
    """Yield differences between counts of activations."""
    for path, counts in recorded.items():
        found = replayed.get(path, {})
        for name, count in counts.items():
            if found.get(name) != count:
                yield Difference(at, "count", path, name, count, found.get(name, NOTHING))


def _foreign(error: ValueError) -> ConfigError:
    return ConfigError.of_one("recording", error, expected="those that a run notes")
