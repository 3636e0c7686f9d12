"""Output ports of a running model, overheard only while somebody wants to hear them.

A tap is opened by the simulator's `listen`, which puts something around the port's `send` and has
no end of its own. What was there before is the port's `bag`, so a tap is closed by putting that
back. Taps may lie on top of each other, as the port of a coupled model and that of the atomic
inside it do; so all are closed, the last one first, before others are opened. A port that nobody
watches is therefore exactly what it was before.

Only between two steps, and only if nobody else listens to the simulator once the run has begun.
"""

from collections import deque
from collections.abc import Mapping
from typing import Any, Final, TypeAlias

from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.ports import InPort, OutPort, StandIn
from firmware_runtime.devs.wiring import sources_of

Heard: TypeAlias = tuple[str, int, object]
"""The port's path, the instant in ns, the value."""

ROOM: Final = 256
"""How many messages may wait to be told; then the oldest makes room."""


class Taps:
    """What has been heard waits in `heard`, oldest first; `lost` counts what found no room."""

    def __init__(self, simulator: Engine) -> None:
        self.heard: deque[Heard] = deque(maxlen=ROOM)
        self.lost = 0
        self._simulator = simulator
        self._ports: Mapping[str, OutPort[Any]] = {}
        self._bags: list[tuple[OutPort[Any], InPort[Any] | StandIn[Any]]] = []

    def open(self, ports: Mapping[str, OutPort[Any]]) -> None:
        """Hear these ports from now on, by path, and no others."""
        if ports == self._ports:
            return
        self._ports = ports
        for source, bag in reversed(self._bags):
            source.bag = bag
        self._bags.clear()
        for path, port in ports.items():
            self._bags += [(source, source.bag) for source in sources_of(port)]
            self._listen(path, port)

    def _listen(self, path: str, port: OutPort[Any]) -> None:
        heard = self.heard

        def hear(at: int, value: object) -> None:
            if len(heard) == ROOM:
                self.lost += 1
            heard.append((path, at, value))

        self._simulator.listen(port, hear)
