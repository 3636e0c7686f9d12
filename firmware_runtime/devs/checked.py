"""Checked mode: the laws that the fast loop trusts a model to keep, watched at every step."""

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.errors import ModelTimeError, OutputChangedState
from firmware_runtime.devs.functions import Functions
from firmware_runtime.devs.ports import InPort, OutPort

_SCALARS = (int, float, complex, str, bytes, bool, type(None))
_DEPTH = 4
"""How deep the state is looked into; below that, objects are told apart by identity."""


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
            port.wrap(lambda send, port=port: self._checked_send(atomic, port, send))
        output = functions.output

        def checked_output() -> None:
            before = snapshot(atomic)
            self._sending = atomic
            output()
            self._sending = None
            changed = [
                name for name, value in snapshot(atomic).items() if before.get(name, ...) != value
            ]
            if changed:
                fault = f"its output function changed {', '.join(changed)}; it may only send"
                raise OutputChangedState(atomic.path, self._simulator.now, fault)

        return replace(functions, output=checked_output)

    def _checked_send(
        self, atomic: Atomic, port: OutPort[object], send
    ) -> Callable[[object], None]:
        def checked_send(value: object) -> None:
            if self._sending is not atomic:
                fault = f"sent on port {port.name!r} outside its output function"
                raise ModelTimeError(atomic.path, self._simulator.now, fault)
            if not isinstance(value, port.type):
                fault = f"port {port.name!r} carries {port.type.__name__}, not {value!r}"
                raise ModelTimeError(atomic.path, self._simulator.now, fault)
            send(value)

        return checked_send


def snapshot(atomic: Atomic) -> dict[str, object]:
    """The model's state by attribute, in a form that can be compared later."""
    return {
        name: _freeze(value, _DEPTH)
        for name, value in vars(atomic).items()
        if name not in {"parent", "in_ports", "out_ports"}
    }


def _freeze(value: object, depth: int) -> object:
    """The value itself if it cannot change, else its contents, else its identity."""
    if isinstance(value, _SCALARS):
        return (type(value), repr(value))  # repr: NaN equals NaN, 1 differs from 1.0
    if isinstance(value, InPort | OutPort) or depth == 0:
        return id(value)
    if isinstance(value, dict):
        return [(_freeze(key, depth - 1), _freeze(each, depth - 1)) for key, each in value.items()]
    if isinstance(value, list | tuple | set | frozenset):
        return (type(value), [_freeze(each, depth - 1) for each in value])
    if hasattr(value, "tobytes"):
        return value.tobytes()
    if isinstance(value, bytearray):
        return bytes(value)
    if hasattr(value, "__dict__") and not callable(value):
        return (id(value), _freeze(vars(value), depth - 1))
    return id(value)
