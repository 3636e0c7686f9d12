"""Whatever an object is, all of its attributes are found."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest

from firmware_runtime.recording.blackbox.state.walk import attributes_of


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
