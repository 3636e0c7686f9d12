"""The other end of a bridge: how a process on any machine speaks with a running robot."""

import socket
from collections.abc import Iterator
from contextlib import suppress
from select import select
from time import monotonic_ns
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.links.bridge.signatures import Acquaintance, Refused
from firmware_runtime.links.endpoint import Endpoint
from firmware_runtime.links.ports.datagrams import TIMEOUT
from firmware_runtime.links.ports.robot_end import AT_ONCE, NoAnswer

HELLO_EVERY: Final = 250 * MILLISECOND
_LONGEST: Final = 1 << 16


class BridgeEnd:
    """A UDP socket that speaks with one bridge; with a key all is signed, and answers verified.

    Without one, the bridge is one on loopback that has none. Raises OSError if there is no way.
    """

    def __init__(self, bridge: Endpoint, key: bytes | None) -> None:
        self._bridge = bridge
        self._acquaintance = None if key is None else Acquaintance(key)
        self._last = b""
        self.why_not_believed = ""
        """As of `RobotEnd`: what is not believed is left out here."""
        self._socket = socket.socket(bridge.family, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        try:
            self._socket.connect(bridge.where)
        except OSError:
            self._socket.close()
            raise

    def fileno(self) -> int:
        """The descriptor that becomes readable when the bridge has said something."""
        return self._socket.fileno()

    def send(self, content: bytes) -> None:
        """Say something; first become acquainted, which is waited for.

        Raises NoAnswer if the bridge does not know the key, another OSError if there is none.
        """
        self._last = content
        if self._acquaintance is None:
            self._socket.send(content)
            return
        if not self._acquaintance.is_made:
            self._meet(self._acquaintance)
        self._socket.send(self._acquaintance.ask(content, monotonic_ns()))

    def received(self) -> Iterator[bytes]:
        """Return what the robot has said, without waiting; what is not believed is left out.

        A bridge that has taken the place of another gets what the other did not take.
        """
        for datagram in self._datagrams():
            if self._acquaintance is None:
                yield datagram
                continue
            with suppress(Refused):
                content = self._acquaintance.believe(datagram, monotonic_ns())
                if content is None:
                    self.send(self._last)
                else:
                    yield content

    def forget(self) -> None:
        """Meet the bridge again before the next is sent: it has not answered."""
        if self._acquaintance is not None:
            self._acquaintance.end()

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _meet(self, acquaintance: Acquaintance) -> None:
        until = monotonic_ns() + TIMEOUT
        while (now := monotonic_ns()) < until:
            self._socket.send(acquaintance.hello(now))
            select([self], (), (), min(HELLO_EVERY, until - now) / SECOND)
            for datagram in self._datagrams():
                with suppress(Refused):
                    acquaintance.believe(datagram, monotonic_ns())
            if acquaintance.is_made:
                return
        expected = "expected a bridge with the same key"
        raise NoAnswer(f"no answer within {TIMEOUT // SECOND} s; {expected}", where=self._bridge)

    def _datagrams(self) -> Iterator[bytes]:
        with suppress(BlockingIOError):
            for _ in range(AT_ONCE):
                yield self._socket.recv(_LONGEST)
