"""Checked mode: the laws that the fast loops trust a model to keep, watched at every step."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import chain
from typing import Any, Protocol

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.errors import OutputChangedState, PortTypeError, SentOutsideOutput
from firmware_runtime.devs.functions import Functions, Wrapped
from firmware_runtime.devs.ports import AnyPort, InPort, OutPort, carries

_DEPTH = 4
"""How deep the state is looked into; what lies below is taken as unchanged."""


class Clocked(Protocol):
    """What the checks need of a simulator: the instant, for their messages."""

    now: int


class Checks:
    """An instrument: outputs may not change the state, sends happen in outputs, types fit."""

    def __init__(self, simulator: Clocked) -> None:
        self._simulator = simulator
        self._sending: Atomic | None = None

    def __call__(self, atomic: Atomic, functions: Functions) -> Functions:
        """Watch one model."""
        for port in atomic.out_ports.values():
            port.wrap(partial(self._checked_send, atomic, port))
        output = self._checked_output(atomic, functions.output)
        rest = functions.internal, functions.external, functions.confluent
        return Wrapped(atomic, output, *rest)

    def _checked_output(self, atomic: Atomic, output: Callable[[], None]) -> Callable[[], None]:
        def checked_output() -> None:
            before = snapshot(atomic)
            self._sending = atomic
            output()
            self._sending = None
            after = snapshot(atomic)
            if after != before:
                names = before.keys() | after.keys()
                changed = sorted(name for name in names if before.get(name) != after.get(name))
                fault = f"its output function changed {', '.join(changed)}; it may only send"
                raise OutputChangedState(atomic.path, self._simulator.now, fault)

        return checked_output

    def _checked_send(
        self, atomic: Atomic, port: OutPort[Any], send: Callable[[Any], None]
    ) -> Callable[[Any], None]:
        def checked_send(value: object) -> None:
            if self._sending is not atomic:
                fault = f"sent on port {port.name!r} outside its output function"
                raise SentOutsideOutput(atomic.path, self._simulator.now, fault)
            if not carries(port.type, type(value)):
                raise PortTypeError(atomic.path, self._simulator.now, wrong_type(port, value))
            send(value)

        return checked_send


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
