"""Ports: typed ends of couplings.

An input port *is* its bag: a list of the values that arrived at this instant, in the order of the
couplings' declaration, emptied by the simulator after the transition that read it. Values are
handed on by reference: treat them as immutable.
"""

import builtins
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeAlias, TypeVar

if TYPE_CHECKING:
    from firmware_runtime.devs.component import Component

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


class Source(Protocol[T_co]):
    """A port as the beginning of a wire: it may carry a narrower type than the wire's end."""

    @property
    def type(self) -> builtins.type[T_co]:
        """The class of the values carried."""


class InPort(list[T], Generic[T]):
    """The bag of values that arrived at this instant; empty between transitions."""

    __slots__ = ("name", "owner", "type")

    def __init__(self, owner: "Component", name: str, type_: type[T]) -> None:
        # No call of list's own: a list is empty from the start, and ports are made by the thousand.
        self.owner = owner
        self.name = name
        self.type = type_

    @property
    def path(self) -> str:
        """The owner's path and the port's name, joined by a dot."""
        return f"{self.owner.path}.{self.name}"

    def __repr__(self) -> str:
        return f"<InPort {self.path} {list.__repr__(self)}>"

    __hash__ = object.__hash__  # type: ignore[assignment]  # a list has none, a port does

    def __eq__(self, other: object) -> bool:
        """Ports are equal when they are the same port; compare `list(port)` for values."""
        return self is other

    def __ne__(self, other: object) -> bool:
        return self is not other


def discard(_value: object) -> None:
    """Where an output goes that nobody is coupled to."""


class OutPort(Generic[T]):
    """Where an output function sends; the simulator replaces `send` when it resolves couplings."""

    __slots__ = ("name", "owner", "send", "type")

    def __init__(self, owner: "Component", name: str, type_: type[T]) -> None:
        self.owner = owner
        self.name = name
        self.type = type_
        self.send: Callable[[T], None] = discard

    @property
    def path(self) -> str:
        """The owner's path and the port's name, joined by a dot."""
        return f"{self.owner.path}.{self.name}"

    def __repr__(self) -> str:
        return f"<OutPort {self.path}>"


AnyPort: TypeAlias = InPort[Any] | OutPort[Any]
"""A port whose type is known at run time only."""
