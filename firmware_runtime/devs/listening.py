"""Listening: functions called for all that leaves by an output port, until they are ended.

A port that is listened to has a `ListenedBag` in the place of its bag, shared by all its
listeners; when the last one ends, the port has its bag back and is exactly what it was before.
"""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from typing import TypeAlias, TypeVar

from firmware_runtime.devs.ports import OutPort, StandIn

T = TypeVar("T")

Listener: TypeAlias = Callable[[int, T], None]
"""Called with the instant in ns, and the value."""


class ListenedBag(StandIn[T]):
    """Hands each value on, then to the listeners of one port, in the order in which they came."""

    __slots__ = ("_inner", "_listeners", "_now", "_port")

    def __init__(self, port: OutPort[T], now: Callable[[], int]) -> None:
        self._port = port
        self._now = now
        self._inner = port.taken_over_by(self)
        self._listeners: tuple[tuple[Listening, Listener[T]], ...] = ()

    def append(self, value: T, /) -> None:
        """Send a value on, then call the listeners."""
        self._inner.send(value)
        read_clock = self._now  # as a local, which CPython calls sooner
        now = read_clock()
        for _, listener in self._listeners:
            listener(now, value)

    def add(self, listening: "Listening", listener: Listener[T]) -> None:
        """Add a listener."""
        self._listeners = (*self._listeners, (listening, listener))

    def remove(self, listening: "Listening") -> None:
        """Remove a listener; with the last one the port has its bag back."""
        self._listeners = tuple(each for each in self._listeners if each[0] is not listening)
        if not self._listeners and self._port.bag is self:
            self._port.bag = self._inner.bag


class Listening(AbstractContextManager["Listening"]):
    """One listener at one port; `end` it, or use it as a context manager.

    It may end at any time, also while it is called. After that nothing is left of it.
    """

    def __init__(self) -> None:
        self._places: list[ListenedBag[object]] = []

    def begin(
        self, ports: Sequence[OutPort[T]], listener: Listener[T], now: Callable[[], int]
    ) -> None:
        """Listen to these ports, each an atomic model's."""
        for port in ports:
            place = port.bag if isinstance(port.bag, ListenedBag) else ListenedBag(port, now)
            place.add(self, listener)
            self._places.append(place)

    def end(self) -> None:
        """Stop listening; again does nothing."""
        for place in self._places:
            place.remove(self)
        self._places.clear()

    def __exit__(self, *_: object) -> None:
        self.end()
