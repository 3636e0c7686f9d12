"""Models that are heard: what leaves every output port, and what models of a world decide.

A model of a world, such as a rig's probe, is none of the robot's own. It sees a world that is not
there in a replay, so what it sent and when it wants to be called next is heard.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any, TypeAlias

from firmware_runtime.blackbox.heard import Heard
from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.functions import Functions, Wrapped
from firmware_runtime.devs.ports import OutPort, StandIn
from firmware_runtime.recording.values import UnknownValue, plain

Sent: TypeAlias = Callable[[tuple[int, Any]], None]


class HeardBag(StandIn[Any]):
    """Hands each value on, and hears it with the port's number."""

    __slots__ = ("_hear", "_inner", "number")

    def __init__(self, port: OutPort[Any], number: int, hear: Sent) -> None:
        self.number = number
        self._hear = hear
        self._inner = port.taken_over_by(self)

    def append(self, value: object, /) -> None:
        """Take one value."""
        self._hear((self.number, value))
        self._inner.send(value)


class WholeBag(HeardBag):
    """The same for a world's model: its values are written so that they can be made again."""

    __slots__ = ()

    def append(self, value: object, /) -> None:
        """Take one value."""
        self._hear((self.number, _in_full(value)))
        self._inner.send(value)


def own_atomics(component: Component) -> Iterator[Atomic]:
    """The atomics of a robot, before a world is attached to it."""
    if isinstance(component, Atomic):
        yield component
    elif isinstance(component, Coupled):
        for each in component.components.values():
            yield from own_atomics(each)


def output_ports(atomics: Iterable[Atomic]) -> list[OutPort[Any]]:
    """All of them, in the order of their numbers."""
    return [port for atomic in atomics for port in atomic.out_ports.values()]


def listen(atomics: Iterable[Atomic], own: frozenset[Atomic], hear: Sent) -> None:
    """Hear what leaves every output port from now on."""
    for number, port in enumerate(output_ports(atomics)):
        (HeardBag if port.owner in own else WholeBag)(port, number, hear)


def heard_world(atomic: Atomic, functions: Functions, heard: Heard) -> Functions:
    """What to call for a world's model, so that it is heard."""
    sent, hear = heard.sent, heard.world.append

    def output() -> None:
        before = len(sent)
        functions.output()
        hear(len(sent) - before)

    def after(function: Callable[..., None], *arguments: int) -> None:
        function(*arguments)
        hear(int(functions.sigma))

    confluent = functions.confluent
    return Wrapped(
        atomic,
        output,
        partial(after, functions.internal),
        partial(after, functions.external),
        None if confluent is None else partial(after, confluent),
    )


def _in_full(value: object) -> object:
    try:
        return plain(value)
    except UnknownValue:
        return None
