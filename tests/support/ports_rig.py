"""A model with its ports on a real socket, run in virtual time, and a client of it."""

import json
import socket
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from firmware_runtime.devs.component import Component
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.links.control import Respond
from firmware_runtime.links.ports.ports import Ports
from firmware_runtime.links.ports.run_socket import RunSocket
from firmware_runtime.system.resources import Closing
from sim_doubles.clock import ManualClock
from tests.support.executives import Run


class Speaker:
    """Another process's end, in this one; what it receives waits until it is taken."""

    def __init__(self, path: Path, own: socket.SocketType | None = None) -> None:
        kind = socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK
        self.socket = own or socket.socket(socket.AF_UNIX, kind)
        self.socket.connect(str(path))

    def say(self, what: object) -> None:
        """Send bytes as they are, anything else as JSON."""
        datagram = what if isinstance(what, bytes) else json.dumps(what).encode()
        self.socket.send(datagram)

    def received(self) -> list[dict[str, Any]]:
        """Everything it received so far."""
        messages: list[dict[str, Any]] = []
        while True:
            try:
                said = self.socket.recv(1 << 18)
            except BlockingIOError:
                return messages
            if not said:
                return messages
            messages.append(json.loads(said))

    def close(self) -> None:
        self.socket.close()


class PortsRig(Closing):
    """A run that has not begun; `now` is the watchers' clock."""

    def __init__(
        self,
        path: Path,
        model: Component,
        answers: Mapping[str, Respond] = MappingProxyType({}),
        slow: Mapping[str, int] = MappingProxyType({}),
    ) -> None:
        self.path = path
        self.now = ManualClock()
        self.run = Run(model, VirtualClock())
        self.ports = RunSocket(
            path, self.run.executive, Ports(model), answers=answers, slow=slow, now=self.now
        )
        self._speakers: list[Speaker] = []

    def speaker(self) -> Speaker:
        """One that the run has greeted."""
        speaker = self.stranger()
        self.ports.receive()
        assert speaker.received() == [{"greets": "firmware-runtime"}]
        return speaker

    def stranger(self) -> Speaker:
        """One that the run has not come to yet."""
        speaker = Speaker(self.path)
        self._speakers.append(speaker)
        return speaker

    def close(self) -> None:
        self.ports.close()
        for speaker in self._speakers:
            speaker.close()
