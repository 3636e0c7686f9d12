"""Output ports of a running model, overheard only while somebody wants to hear them.

A port that is not watched, or no longer, is exactly what it was before.
"""

from collections import deque
from collections.abc import Mapping
from typing import Any, Final, TypeAlias

from firmware_runtime.devs.engine import Engine
from firmware_runtime.devs.listening import Listening
from firmware_runtime.devs.ports import OutPort

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
        self._listening: list[Listening] = []

    def open(self, ports: Mapping[str, OutPort[Any]]) -> None:
        """Hear these ports from now on, by path, and no others."""
        if ports == self._ports:
            return
        self._ports = ports
        for listening in self._listening:
            listening.end()
        self._listening = [self._listen(path, port) for path, port in ports.items()]

    def _listen(self, path: str, port: OutPort[Any]) -> Listening:
        heard = self.heard

        def hear(at: int, value: object) -> None:
            if len(heard) == ROOM:
                self.lost += 1
            heard.append((path, at, value))

        return self._simulator.listen(port, hear)
