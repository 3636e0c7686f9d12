"""The paper's blocks in a model that runs in real time: what they say leaves, what comes arrives.

Texts that `SndDover` blocks send go to a carrier, a process of its own, which sends each as one UDP
datagram to its port of this machine; those that come to a port are external events of all
`RcvDover` blocks with that port.

To the loop this is a source, and a hook that sends between two steps; it never waits.
"""

import subprocess
from collections import deque
from collections.abc import Sequence
from functools import partial
from typing import Any, Final

from firmware_runtime.devs.ports import InPort
from firmware_runtime.executive.executive import Executive
from firmware_runtime.links.cut.channel import CarrierChannel, ChannelClosed, frames
from firmware_runtime.links.dover.blocks import DoverBlocks
from firmware_runtime.links.dover.carrier import HEAD, Counts, counts_of
from firmware_runtime.statistics.statistics import RunState

AT_ONCE: Final = 64
"""How many texts are read in one pass of the loop."""
ROOM: Final = 256
"""How many texts may wait to be sent; then the oldest makes room."""


class DoverLink:
    """The blocks of a model on its executive, and their carrier, which it starts.

    Raises ConfigError if a port is taken.
    """

    def __init__(self, blocks: DoverBlocks, executive: Executive) -> None:
        self.received = self.sent = self.dropped = 0
        """Texts since the start; those dropped found no room here."""
        self.carrier = Counts()
        """What the carrier has counted, of a second ago at most."""
        self._request_stop = executive.request_stop
        self._entrances = blocks.entrances
        ports = ",".join(map(str, blocks.entrances))
        self._channel = CarrierChannel("firmware_runtime.links.dover.carrier", [ports], "DOVER")
        self._left: deque[tuple[int, str]] = deque(maxlen=ROOM)
        for block in blocks.senders:
            executive.simulator.listen(block.text, partial(self._leave, block.udp_port))
        executive.add_source(self)
        executive.hooks.append(self)

    @property
    def process(self) -> "subprocess.Popen[bytes]":
        """The carrier."""
        return self._channel.process

    def fileno(self) -> int:
        """The descriptor that becomes readable when a text has come."""
        return self._channel.fileno()

    def receive(self) -> Sequence[tuple[InPort[Any], object]]:
        """The texts that have come, in their order."""
        arrived: list[tuple[InPort[Any], object]] = []
        try:
            for frame in frames(self._channel, AT_ONCE):
                (port,) = HEAD.unpack_from(frame)
                if port == 0:
                    self.carrier = counts_of(frame)
                else:
                    text = frame[HEAD.size :].decode("latin-1")
                    arrived.append((self._entrances[port], text))
        except ChannelClosed:
            self._request_stop("the carrier of the DOVER blocks has ended", RunState.FAILED)
        self.received += len(arrived)
        return arrived

    def between_steps(self, _now: int, _left: int) -> None:
        """Send what has left."""
        while self._left:
            port, text = self._left.popleft()
            try:
                self._channel.send(HEAD.pack(port) + text.encode())
            except OSError:
                self.dropped += 1
            else:
                self.sent += 1

    def close(self) -> None:
        """End the carrier."""
        self._channel.close()

    def _leave(self, port: int, _at: int, text: str) -> None:
        self.dropped += len(self._left) == ROOM
        self._left.append((port, text))
