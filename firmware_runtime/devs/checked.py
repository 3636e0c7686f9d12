"""The laws that the fast loops trust a model to keep, watched at every step.

That values are sent in output functions only, and of the port's type, is watched in virtual time
unless it is switched off. That an output function leaves the state alone takes a copy of the state
around every output, and is watched when asked for.
"""

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any, Protocol

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.functions import Functions, Wrapped
from firmware_runtime.devs.model_errors import OutputChangedState, PortTypeError, SentOutsideOutput
from firmware_runtime.devs.ports import AnyPort, InPort, OutPort, StandIn, carries

_DEPTH = 4
"""How deep the state is looked into; what lies below is taken as unchanged."""


class Sending(Protocol):
    """What the checks need of a simulator: the instant, and which model's output is under way."""

    now: int
    sending: int


class StateCheck:
    """An instrument: an output function that changes its model's state is an error."""

    def __init__(self, simulator: Sending) -> None:
        self._simulator = simulator

    def __call__(self, atomic: Atomic, functions: Functions) -> Functions:
        """Watch one model."""

        def checked_output() -> None:
            before = snapshot(atomic)
            functions.output()
            after = snapshot(atomic)
            if after != before:
                names = before.keys() | after.keys()
                changed = sorted(name for name in names if before.get(name) != after.get(name))
                fault = f"its output function changed {', '.join(changed)}; it may only send"
                raise OutputChangedState(atomic.path, self._simulator.now, fault)

        rest = functions.internal, functions.external, functions.confluent
        return Wrapped(atomic, checked_output, *rest)


class CheckedBag(StandIn[Any]):
    """In the place of a port's bag: takes what its model's output sends, of the port's type."""

    __slots__ = ("_entry", "_inner", "_kind", "_number", "_port", "_register", "_simulator")

    def __init__(self, port: OutPort[Any], number: int, simulator: Sending) -> None:
        inner = port.taken_over_by(self)
        self._number = number
        self._port, self._kind, self._simulator = port, port.type, simulator
        self._inner, self._register, self._entry = inner.bag, inner.register, inner.entry

    def append(self, value: object, /) -> None:
        """Put one value into the bag. Raises SentOutsideOutput, PortTypeError."""
        if self._simulator.sending != self._number:
            fault = f"sent on port {self._port.name!r} outside its output function"
            raise SentOutsideOutput(self._port.owner.path, self._simulator.now, fault)
        if type(value) is not self._kind and not carries(self._kind, type(value)):
            fault = wrong_type(self._port, value)
            raise PortTypeError(self._port.owner.path, self._simulator.now, fault)
        inner = self._inner
        if not inner:
            self._register.append(self._entry)
        inner.append(value)


def wrong_type(port: AnyPort, value: object) -> str:
    """What is wrong with a value that a port does not carry."""
    return f"port {port.name!r} carries {port.type.__name__}, not {value!r}"


def snapshot(atomic: Atomic) -> dict[str, object]:
    """The model's state by attribute, in a form that can be compared later."""
    return {
        name: _frozen(value, _DEPTH)
        for name, value in vars(atomic).items()
        if name not in {"parent", "in_ports", "out_ports"}
    }


def _frozen(value: object, depth: int) -> object:
    """Something that is equal later if `value` has not changed, and else is not."""
    if isinstance(value, float | complex):
        return repr(value)  # in words, NaN is equal to itself
    if isinstance(value, int | str | bytes | None):
        return type(value), value
    if isinstance(value, InPort | OutPort | Component) or callable(value):
        return value
    if depth == 0:
        return type(value)
    contents = _contents(value)
    return id(value) if contents is None else [_frozen(each, depth - 1) for each in contents]


def _contents(value: object) -> Iterable[object] | None:
    """What an object is made of; None if its identity is all there is to compare."""
    if isinstance(value, list | tuple | set | frozenset):
        return value
    if isinstance(value, dict):
        return chain.from_iterable(value.items())
    return _pickled(value)


def _pickled(value: object) -> Iterable[object] | None:
    """What pickle would save of an object, or None."""
    try:
        saved = value.__reduce_ex__(2)
    except Exception:  # noqa: BLE001 -- whatever the reason, it cannot be saved
        return None
    if isinstance(saved, str):
        return None
    _, arguments, *rest = saved
    return chain(arguments, *(each if isinstance(each, Iterator) else (each,) for each in rest))
