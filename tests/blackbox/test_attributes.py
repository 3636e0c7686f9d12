"""Attributes are read without making an object slower; whatever it is, all of them are found."""

import gc
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from firmware_runtime.recording.blackbox.state import attributes
from firmware_runtime.recording.blackbox.state.attributes import attributes_of, reader_of


class Plain:
    """Attributes of its own, one of the class, one with a default."""

    kind = "plain"
    limit = 1.0

    def __init__(self) -> None:
        self.second, self.first = [2], 1
        self.limit = 2.0

    @property
    def computed(self) -> int:
        """No attribute."""
        return self.first

    def grow(self) -> None:
        """Get another one."""
        self.third = 3


class Slotted(Plain):
    """A slot beside its attributes."""

    __slots__ = ("slot",)

    def __init__(self) -> None:
        super().__init__()
        self.slot = "slot"


@dataclass
class Fields:
    """Attributes set by code that was made."""

    one: int
    two: object


class Same(Plain):
    """One that is the very object that its class has under the name."""

    def __init__(self) -> None:
        super().__init__()
        self.kind = Plain.kind


class Asked(Plain):
    """One that computes what it has not."""

    def __getattr__(self, name: str) -> str:
        return name


class Bag(list[int]):
    """More than attributes."""

    def __init__(self) -> None:
        super().__init__([1, 2])
        self.first = 1


class Given:
    """What others set on it."""


def fields() -> Fields:
    """A dataclass."""
    return Fields(1, None)


def given() -> Given:
    """An object whose class does not know its attribute."""
    made = Given()
    made.unforeseen = 1  # type: ignore[attr-defined]
    return made


KINDS: list[Callable[[], object]] = [Plain, Slotted, fields, Same, Asked, Bag, given, Given]


@pytest.mark.parametrize("make", KINDS)
def test_all_are_found_whatever_the_class(make: Callable[[], object]) -> None:
    thing, twin = make(), make()
    assert attributes_of(thing) == vars(twin)
    assert list(attributes_of(thing)) == sorted(vars(twin))
    assert dict(reader_of(make())()) == vars(twin)


@pytest.mark.parametrize("make", [Plain, fields, Given])
def test_no_dictionary_is_made_where_the_code_names_all(
    monkeypatch: pytest.MonkeyPatch, make: Callable[[], object]
) -> None:
    """As up to 3.12; from 3.13 on a dictionary makes nothing slower."""
    monkeypatch.setattr(attributes, "_DICTIONARIES_ARE_FREE", False)
    thing = make()
    attributes_of(thing)
    reader_of(thing)()
    assert dict not in {type(each) for each in gc.get_referents(thing)}


def unset(thing: Plain, name: str) -> None:
    """Delete one, and set another that the code does not name."""
    delattr(thing, name)
    thing.unforeseen = 1  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda thing: setattr(thing, "first", 7), {"first": 7, "second": [2], "limit": 2.0}),
        (Plain.grow, {"first": 1, "second": [2], "limit": 2.0, "third": 3}),
        (lambda thing: delattr(thing, "second"), {"first": 1, "limit": 2.0}),
        (lambda thing: unset(thing, "second"), {"first": 1, "limit": 2.0, "unforeseen": 1}),
        (lambda thing: unset(thing, "limit"), {"first": 1, "second": [2], "unforeseen": 1}),
    ],
)
def test_a_reader_sees_what_is_set_and_deleted_later(
    change: Callable[[Plain], None], expected: dict[str, object]
) -> None:
    thing = Plain()
    read = reader_of(thing)
    change(thing)
    assert read() == expected
