"""Ports: typed ends of couplings, and what watches the values that leave by them.

An input port *is* its bag: a list of the values that arrived at this instant, in the order they
were sent, emptied by the simulator after the transition that read it. An output port holds the bags
its values go into. Values are handed on by reference: treat them as immutable.

A port is watched if its values are checked, recorded or listened to. All of that stands in `send`
itself: between two steps of a robot each further function is as slow as its first call.
"""

import builtins
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import Any, Generic, Literal, Protocol, TypeAlias, TypeVar

from firmware_runtime.errors import Named

T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)
P = TypeVar("P")

Takes: TypeAlias = Literal["finite", "infinities", "any"]
"""Which numbers an input port takes: finite ones, all but NaN, or all."""
Check: TypeAlias = Callable[[Any], bool]
"""Returns whether a port takes a value. May raise TypeError for one of another type."""
Sent: TypeAlias = list[Any]
"""Number of a port and value, in turns: one list, since a pair would be an object for each."""
Bag: TypeAlias = Any
"""Where an output port puts values: an input port, or what a simulator has in its place."""
Listener: TypeAlias = Callable[[int, T], None]
"""Called with the instant in ns, and the value."""


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

    Values that it does not take by `takes` do not get into it: see `finite`. `model` is the number
    of its owner in the simulator.
    """

    __slots__ = ("entry", "model", "name", "owner", "register", "takes", "type")

    model: int
    register: list[Any]
    entry: Any

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


class Carrier(Protocol):
    """What a port asks of its simulator: the instant, and whose output function is under way."""

    now: int
    sending: int

    def refuse_sent(self, port: "OutPort[Any]", value: object) -> None:
        """Raise SentOutsideOutput, or PortTypeError."""

    def refuse(self, port: "OutPort[Any]", value: object) -> Sequence[Bag]:
        """Report the ends that do not take a value; return those that do."""


class OutPort(Generic[T]):
    """Where an output function sends.

    A simulator connects it to its `ends`; `reached` gets the number of a model before the first
    value goes into a bag of it. A port that is recorded appends its `number` and each value to
    `sent`; of a value of another class than `kind`, of which `look` returns other than what was
    `seen`, or with items of other classes than `leaves`, it appends itself and the value's place to
    `unlike`.
    """

    __slots__ = (
        *("_check", "_is_checked", "_only", "_simulator", "ends", "listeners", "model"),
        *("name", "owner", "type"),
        *("kind", "leaves", "look", "number", "seen", "sent", "unlike"),
    )

    number: int
    kind: builtins.type[Any] | None
    look: Callable[[Any], object] | None
    seen: object
    leaves: frozenset[builtins.type[Any]] | None
    unlike: list[Any] | None
    model: int
    _simulator: Carrier

    def __init__(self, owner: Owner, name: str, type_: type[T]) -> None:
        self.owner = owner
        self.name = name
        self.type = type_
        self.ends: Sequence[Bag] = ()
        self.listeners: tuple[Listening, ...] = ()
        self.sent: Sent | None = None
        self._check: Check | None = None
        self._is_checked = False
        self._only: Bag | None = None

    def send(self, value: T) -> None:  # noqa: C901 -- in one frame, see above
        """Deliver one value to every port coupled to this one."""
        only = self._only
        if only is not None:
            if not only:
                only.register.append(only.entry)
            only.append(value)
            return
        sent, ends, check = self.sent, self.ends, self._check
        if sent is not None:
            sent.append(self.number)
            sent.append(value)
            look, leaves, unlike = self.look, self.leaves, self.unlike
            if unlike is not None and (
                type(value) is not self.kind
                or (look is not None and look(value) != self.seen)
                or (leaves is not None and not leaves.issuperset(map(type, value)))  # type: ignore[call-overload]  # it is a sequence then
            ):
                unlike.append(self)
                unlike.append(len(sent) - 1)
        if self._is_checked and (
            self._simulator.sending != self.model
            or (type(value) is not self.type and not carries(self.type, type(value)))
        ):
            self._simulator.refuse_sent(self, value)
        if check is not None:
            try:
                is_taken = check(value)
            except (TypeError, OverflowError):  # of another type, or beyond every float
                is_taken = False
            if not is_taken:
                ends = self._simulator.refuse(self, value)
        for bag in ends:
            if not bag:
                bag.register.append(bag.entry)
            bag.append(value)
        for each in self.listeners:
            each.listener(each.simulator.now, value)

    @property
    def leads_somewhere(self) -> bool:
        """Whether it is coupled, recorded or listened to: if not, a value need not even be made.

        A model that asks makes its value in every recorded run, so that the same leaves it in a
        replay, where there is no `--trace` and no plot, as in the run, where there may have been. A
        recording does not depend on who else listened, and has the value for `export` and `debug`.
        """
        return bool(self.ends or self.listeners) or self.sent is not None

    def connect(
        self,
        simulator: Carrier,
        model: int,
        ends: Sequence[Bag],
        check: Check | None,
    ) -> None:
        """Send into these bags from now on, what the check takes of it; `model` is its owner's."""
        self._simulator, self.model = simulator, model
        self.ends, self._check = ends, check
        self.listeners, self._is_checked = (), False
        self._choose_way()

    def check_sends(self) -> None:
        """Refuse what is sent outside of an output function, or is of another type."""
        self._is_checked = True
        self._choose_way()

    def record(self, number: int, sent: Sent, unlike: list[object] | None = None) -> None:
        """From now on, append what leaves to `sent`, by this number; all is unlike at first."""
        self.number, self.sent, self.unlike = number, sent, unlike
        self.kind = self.look = self.seen = self.leaves = None
        self._choose_way()

    def set_listeners(self, listeners: "tuple[Listening, ...]") -> None:
        """Call these after a value was delivered, in this order."""
        self.listeners = listeners
        self._choose_way()

    def _choose_way(self) -> None:
        """Take the short way where there is one bag, and nothing to do but to fill it."""
        is_watched = self._is_checked or self._check or self.listeners or self.sent is not None
        self._only = None if is_watched or len(self.ends) != 1 else self.ends[0]

    @property
    def path(self) -> str:
        """The owner's path and the port's name, joined by a dot."""
        return f"{self.owner.path}.{self.name}"

    def __repr__(self) -> str:
        return f"<OutPort {self.path}>"


class Listening(AbstractContextManager["Listening"]):
    """One listener at some ports; `end` it, or use it as a context manager.

    It may end at any time, also while it is called. After that nothing is left of it.
    """

    def __init__(
        self, listener: Listener[Any], ports: Sequence[OutPort[object]], simulator: Carrier
    ) -> None:
        self.listener = listener
        self.simulator = simulator
        self._ports = ports
        for port in ports:
            port.set_listeners((*port.listeners, self))

    def end(self) -> None:
        """Stop listening; again does nothing."""
        for port in self._ports:
            port.set_listeners(tuple(each for each in port.listeners if each is not self))
        self._ports = ()

    def __exit__(self, *_: object) -> None:
        self.end()


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
