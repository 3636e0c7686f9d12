"""That an output function leaves its model's state alone: watched where that is asked for.

It takes a copy of the state around every output. That values are sent in output functions only, and
of the port's type, is seen to by the port itself, in virtual time unless it is switched off.
"""

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Protocol

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.functions import Functions, Wrapped
from firmware_runtime.devs.model_errors import OutputChangedState
from firmware_runtime.devs.ports import InPort, OutPort

_DEPTH = 4
"""How deep the state is looked into; what lies below is taken as unchanged."""


class Stepping(Protocol):
    """What the check needs of a simulator."""

    now: int


class StateCheck:
    """An instrument: an output function that changes its model's state is an error."""

    def __init__(self, simulator: Stepping) -> None:
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
