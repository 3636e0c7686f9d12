"""The paper's blocks in a model that runs in real time: texts over UDP of this machine.

A text that an `SndDover` block sends is one UDP datagram to its port at 127.0.0.1; those that come
to a port are external events of all `RcvDover` blocks with that port. A block whose `text` is
coupled within the model speaks with that, and not with the network: so a model of both ends runs in
virtual time too.

To the loop each port is a source, and the link a hook that sends between two steps; nothing waits.
"""

import socket
from collections import deque
from collections.abc import Sequence
from functools import partial
from typing import Any, Final, TypeAlias

from firmware_runtime.devs.component import Component
from firmware_runtime.devs.coupled import Coupled, with_all_below
from firmware_runtime.devs.ports import InPort, Owner
from firmware_runtime.executive.clocks import Clock, VirtualClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.links.endpoint import AT_ONCE, Endpoint, bound, datagrams
from firmware_runtime.models.dover import DoverBlock, RcvDover, SndDover

LOOPBACK: Final = "127.0.0.1"
NEWEST: Final = 8
"""Texts of one port that enter the model at once; older ones that came with them are dropped."""
ROOM: Final = 256
"""Texts that may wait to be sent; then the oldest makes room."""
_LONGEST: Final = 256
"""Bytes that are read of a datagram: more than any text that is a number."""

Entrances: TypeAlias = dict[int, InPort[str]]
"""Input ports of the top model by the port of UDP whose texts they take."""


class DoverBlocks:
    """The blocks of a model that speak with the network; draws couplings to the receivers.

    The model must not be on an executive yet. In virtual time there is no network, and none speaks.
    """

    def __init__(self, root: Component, clock: Clock) -> None:
        is_virtual = isinstance(clock, VirtualClock)
        blocks = [
            each
            for each in with_all_below(root)
            if isinstance(each, DoverBlock) and not (is_virtual or _is_coupled(each))
        ]
        self.senders = [each for each in blocks if isinstance(each, SndDover)]
        self.entrances: Entrances = {
            each.udp_port: _entrance(each, root) for each in blocks if isinstance(each, RcvDover)
        }

    def __bool__(self) -> bool:
        return bool(self.senders or self.entrances)


class DoverLink:
    """The blocks of a model on its executive, with their sockets on 127.0.0.1.

    Raises ConfigError if a port is taken.
    """

    def __init__(self, blocks: DoverBlocks, executive: Executive) -> None:
        self.sent = self.dropped = 0
        """Texts since the start; those dropped found no room, here or in the kernel."""
        self._left: deque[tuple[int, str]] = deque(maxlen=ROOM)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._receivers: list[_Receiver] = []
        try:
            for udp_port, entrance in blocks.entrances.items():
                self._receivers.append(_Receiver(bound_to(udp_port, "DOVER"), entrance))
        except BaseException:
            self.close()
            raise
        for receiver in self._receivers:
            executive.add_source(receiver)
        for block in blocks.senders:
            executive.simulator.listen(block.text, partial(self._leave, block.udp_port))
        executive.hooks.append(self)

    @property
    def received(self) -> int:
        """Texts that entered the model since the start."""
        return sum(each.received for each in self._receivers)

    @property
    def preempted(self) -> int:
        """Texts that newer ones of their port replaced before they could enter."""
        return sum(each.preempted for each in self._receivers)

    def between_steps(self, _now: int, _left: int) -> None:
        """Send what has left."""
        while self._left:
            udp_port, text = self._left.popleft()
            try:
                self._socket.sendto(text.encode(), (LOOPBACK, udp_port))
            except OSError:  # no room; a missing peer is not noticed
                self.dropped += 1
            else:
                self.sent += 1

    def close(self) -> None:
        """Close the sockets."""
        self._socket.close()
        for receiver in self._receivers:
            receiver.socket.close()

    def _leave(self, udp_port: int, _at: int, text: str) -> None:
        if len(self._left) == ROOM:
            self.dropped += 1
        self._left.append((udp_port, text))


class _Receiver:
    """A source of the loop: one port of UDP, whose texts enter the model by one of its ports."""

    def __init__(self, taken: socket.socket, entrance: InPort[str]) -> None:
        self.received = self.preempted = 0
        self.socket = taken
        self._entrance = entrance

    def fileno(self) -> int:
        return self.socket.fileno()

    def receive(self) -> Sequence[tuple[InPort[Any], object]]:
        texts = waiting_in(self.socket, AT_ONCE)
        newest = texts[-NEWEST:]
        self.received += len(newest)
        self.preempted += len(texts) - len(newest)
        return [(self._entrance, text.decode("latin-1")) for text in newest]


def bound_to(udp_port: int, option: str) -> socket.socket:
    """Return a socket at a port of 127.0.0.1. Raises ConfigError about `option` if it is taken."""
    return bound(option, Endpoint(socket.AF_INET, (LOOPBACK, udp_port)))


def waiting_in(taken: socket.socket, most: int) -> list[bytes]:
    """Return the datagrams that have come, `most` of them, without waiting."""
    return [text for text, _ in datagrams(taken, _LONGEST, most)]


def _is_coupled(block: DoverBlock) -> bool:
    """Return whether something within the model feeds its text, or takes it."""
    if not isinstance(block.parent, Coupled):
        return False
    port = {**block.in_ports, **block.out_ports}["text"]
    return any(port in coupling for coupling in block.parent.couplings)


def _entrance(block: RcvDover, root: Component) -> InPort[str]:
    """Return the root's input port for a block, coupled down to it; those of one port share it."""
    above: Owner | None = block.parent
    end = block.text
    while isinstance(above, Coupled):
        name = f"dover:{block.udp_port}"
        begin = above.in_ports[name] if name in above.in_ports else above.in_port(name, str)
        if (begin, end) not in above.couplings:
            above.couple(begin, end)
        if above is root:
            return begin
        end, above = begin, above.parent
    return end
