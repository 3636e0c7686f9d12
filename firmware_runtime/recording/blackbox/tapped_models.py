"""Tapped models: what leaves every output port, and what models of a world decide.

A model of a world, such as a rig's probe, is none of the robot's own. It sees a world that is not
there in a replay, so what it sent and when it wants to be called next is recorded.
"""

from collections.abc import Iterable, Iterator
from typing import Any

from firmware_runtime.devs.atomic import Atomic
from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import with_all_below
from firmware_runtime.devs.functions import Functions, Wrapped
from firmware_runtime.devs.ports import OutPort, Sent
from firmware_runtime.recording.blackbox.pending import Pending


def own_atomics(component: Component) -> Iterator[Atomic]:
    """The atomics of a robot, before a world is attached to it."""
    return (each for each in with_all_below(component) if isinstance(each, Atomic))


def output_ports(atomics: Iterable[Atomic]) -> list[OutPort[Any]]:
    """All of them, in the order of their numbers."""
    return [port for atomic in atomics for port in atomic.out_ports.values()]


def tap_outputs(
    atomics: Iterable[Atomic],
    sent: Sent,
    numbers: Iterable[int] | None = None,
    unlike: list[Any] | None = None,
) -> None:
    """Append what leaves every output port from now on, by these numbers or in order."""
    ports = output_ports(atomics)
    for number, port in zip(numbers or range(len(ports)), ports, strict=True):
        port.record(number, sent, unlike)


def tapped_world(atomic: Atomic, functions: Functions, pending: Pending) -> Functions:
    """What to call for a world's model, so that it is recorded."""
    sent, world = pending.sent, pending.world
    send, transit, take, confluent = (
        functions.output,
        functions.internal,
        functions.external,
        functions.confluent,
    )

    def output() -> None:
        before = len(sent)
        send()
        world.append((len(sent) - before) // 2)

    def internal() -> None:
        transit()
        world.append(atomic.sigma)

    def external(elapsed: int) -> None:
        take(elapsed)
        world.append(atomic.sigma)

    def both() -> None:
        confluent()  # type: ignore[misc]  # only called where there is one
        world.append(atomic.sigma)

    return Wrapped(atomic, output, internal, external, None if confluent is None else both)
