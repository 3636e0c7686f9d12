"""A dictionary by names, whose error for another name has the nearest one."""

from typing import ClassVar, NoReturn, TypeVar

from firmware_runtime.errors import UnknownName

V = TypeVar("V")


class Named(dict[str, V]):
    """A dictionary by names; a name that it has not raises UnknownName, which is a KeyError."""

    __slots__ = ()
    noun: ClassVar = "entry"

    def __missing__(self, name: object) -> NoReturn:
        raise UnknownName.of(self.noun, name, self)
