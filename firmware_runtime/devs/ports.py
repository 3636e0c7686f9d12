"""Ports: typed ends of couplings.

An input port *is* its bag: a list of the values that arrived at this instant, in the order they
were sent, emptied by the simulator after the transition that read it. An output port holds the bag
its values go into: the input port it feeds, or something that stands in for it. Values are handed
on by reference: treat them as immutable.
"""

import builtins
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, Final, Generic, Literal, Protocol, TypeAlias, TypeVar

from firmware_runtime.devs.named import Named

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)
P = TypeVar("P")

Takes: TypeAlias = Literal["finite", "infinities", "any"]
"""Which numbers an input port takes: finite ones, all but NaN, or all."""


class PortsByName(Named[P]):
    """Ports of a model; another name raises UnknownName."""

    __slots__ = ()
    noun = "port"


class Owner:
    """What has ports: a name, and a place in the tree below `parent`."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.parent: Owner | None = None
        self.in_ports: dict[str, InPort[Any]] = PortsByName()
        self.out_ports: dict[str, OutPort[Any]] = PortsByName()

    @property
    def path(self) -> str:
        """Names from the root to this model, joined by dots: `tachobot.controller.yaw`."""
        return self.name if self.parent is None else f"{self.parent.path}.{self.name}"


class InPort(list[T], Generic[T]):
    """The bag of values that arrived at this instant; empty between transitions.

    Values that it does not take by `takes` do not get into it: see `finite`.
    """

    __slots__ = ("name", "owner", "takes", "type")

    def __init__(self, owner: Owner, name: str, type_: type[T], *, takes: Takes = "finite") -> None:
        # list's own __init__ is left out: it would empty what is empty, for every port made.
        self.owner = owner
        self.name = name
        self.type = type_
        self.takes = takes

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


class StandIn(ABC, Generic[T]):
    """What an output port may have in place of the bag of a single input port."""

    __slots__ = ()

    @abstractmethod
    def append(self, value: T, /) -> None:
        """Take one value."""


class Relay(StandIn[T]):
    """Hands each value to a function."""

    __slots__ = ("_take",)

    def __init__(self, take: Callable[[T], None]) -> None:
        self._take = take

    def append(self, value: T, /) -> None:
        """Call the function."""
        self._take(value)


class Nowhere(StandIn[Any]):
    """Drops each value."""

    __slots__ = ()

    def append(self, value: object, /) -> None:
        """Drop one value."""


class Register(Protocol):
    """Where it is noted that a bag has got its first value."""

    def append(self, entry: Any, /) -> None:  # noqa: ANN401 -- each register has entries of its own
        """Note it."""


class OutPort(Generic[T]):
    """Where an output function sends.

    The simulator sets `bag` when it resolves the couplings, and, if that is the bag of one input
    port, `entry`, which goes into `register` before the first value goes into the empty bag.
    Only a tapped port has those below (`tapped_ports`).
    """

    __slots__ = (
        *("bag", "entry", "name", "owner", "register", "type"),
        *("kind", "look", "number", "seen", "sent", "unlike"),
    )

    number: int
    sent: list[Any]
    kind: builtins.type[Any] | None
    look: Callable[[Any], object] | None
    seen: object
    unlike: Register

    def __init__(self, owner: Owner, name: str, type_: type[T]) -> None:
        self.owner = owner
        self.name = name
        self.type = type_
        self.bag: InPort[T] | StandIn[T] = NOWHERE
        self.register: Register = NOWHERE
        self.entry: object = None

    def send(self, value: T) -> None:
        """Deliver one value to every port coupled to this one."""
        bag = self.bag
        if not bag:
            self.register.append(self.entry)
        bag.append(value)

    @property
    def leads_somewhere(self) -> bool:
        """Whether it is coupled or listened to: if not, a value need not even be made."""
        return self.bag is not NOWHERE

    def taken_over_by(self, bag: StandIn[T]) -> "OutPort[T]":
        """Send into `bag` from now on; returns a port that sends where this one did."""
        inner = self._as_it_was()
        self.bag = bag
        return inner

    def _as_it_was(self) -> "OutPort[T]":
        inner = OutPort(self.owner, self.name, self.type)
        inner.bag, inner.register, inner.entry = self.bag, self.register, self.entry
        return inner

    @property
    def path(self) -> str:
        """The owner's path and the port's name, joined by a dot."""
        return f"{self.owner.path}.{self.name}"

    def __repr__(self) -> str:
        return f"<OutPort {self.path}>"


NOWHERE: Final = Nowhere()
"""The bag of an output port that feeds none."""

AnyPort: TypeAlias = InPort[Any] | OutPort[Any]
"""A port whose type is known at run time only."""


class Source(Protocol[T_co]):
    """A port as the beginning of a wire: it may carry a narrower type than the wire's end."""

    @property
    def type(self) -> builtins.type[T_co]:
        """The class of the values carried."""


def carries(port_type: type[object], value_type: type[object]) -> bool:
    """Whether a port of one type takes values of another: of a subclass, or whole numbers as float.

    The latter is the rule type checkers follow (PEP 484, the numeric tower).
    """
    return issubclass(value_type, port_type) or (port_type is float and issubclass(value_type, int))
