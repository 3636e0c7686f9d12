"""The process that carries texts of the paper's blocks over UDP, on this machine only.

    python -m firmware_runtime.links.dover.carrier DESCRIPTOR PORT[,PORT]

DESCRIPTOR is a socket to the run; each message on it is the number of a port of UDP, two bytes, and
a text. Texts from the run go to these ports at 127.0.0.1, those that come to one of the PORTs there
go to the run. Where many have come since the last poll, the newest `NEWEST` of each port go on.
Nothing waits; what finds no room is dropped. Counts go to the run as port 0. It ends when the run
does.
"""

import contextlib
import signal
import socket
import sys
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from selectors import EVENT_READ, DefaultSelector
from struct import Struct
from time import monotonic
from typing import Final

HEAD: Final = Struct("!H")
NEWEST: Final = 8
"""How many texts of one port go on at once."""
LOOPBACK: Final = "127.0.0.1"
REPORT_EVERY_S: Final = 1.0
_AT_ONCE: Final = 256
_LONGEST: Final = 256
"""Bytes that are read of a datagram: more than any text that is a number."""
_COUNTS: Final = Struct("!H4Q")


@dataclass(slots=True)
class Counts:
    """Datagrams since the start."""

    received: int = 0
    """From UDP."""
    sent: int = 0
    """To UDP."""
    preempted: int = 0
    """Replaced by newer ones of their port before they could go on."""
    dropped: int = 0
    """Those that found no room, or no peer."""


def counts_of(frame: bytes) -> Counts:
    """The counts that a frame of port 0 bears."""
    return Counts(*_COUNTS.unpack(frame)[1:])


class Carrier:
    """Carries between the run's socket and these ports. Raises OSError for one that is taken."""

    def __init__(self, run: socket.socket, ports: Sequence[int]) -> None:
        self.counts = Counts()
        self._run = run
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._selector = DefaultSelector()
        self._selector.register(run, EVENT_READ, 0)
        self._reported = (Counts(), 0.0)
        for port in ports:
            taken = socket.socket(socket.AF_INET, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
            taken.bind((LOOPBACK, port))
            self._selector.register(taken, EVENT_READ, port)

    def work(self) -> bool:
        """Carry what there is; wait for it. Returns whether the run is still there."""
        for key, _ in self._selector.select(REPORT_EVERY_S):
            if key.data != 0:
                self._from_udp(key.fileobj, key.data)  # type: ignore[arg-type]  # a socket
            elif not self._from_run():
                return False
        self._report()
        return True

    def _from_run(self) -> bool:
        for _ in range(_AT_ONCE):
            try:
                frame = self._run.recv(_LONGEST)
            except BlockingIOError:
                return True
            except OSError:
                return False
            if not frame:
                return False
            (port,) = HEAD.unpack_from(frame)
            self._send(frame[HEAD.size :], port)
        return True

    def _send(self, text: bytes, port: int) -> None:
        try:
            self._udp.sendto(text, (LOOPBACK, port))
        except OSError:  # no room; a missing peer is not noticed, or only by the next
            self.counts.dropped += 1
        else:
            self.counts.sent += 1

    def _from_udp(self, taken: socket.socket, port: int) -> None:
        texts: list[bytes] = []
        with contextlib.suppress(OSError):
            while len(texts) < _AT_ONCE:
                texts.append(taken.recv(_LONGEST))
        self.counts.received += len(texts)
        self.counts.preempted += max(0, len(texts) - NEWEST)
        for text in texts[-NEWEST:]:
            self._to_run(HEAD.pack(port) + text)

    def _to_run(self, frame: bytes) -> None:
        try:
            self._run.send(frame)
        except OSError:
            self.counts.dropped += 1

    def _report(self) -> None:
        last, at = self._reported
        if self.counts != last and monotonic() >= at + REPORT_EVERY_S:
            self._reported = Counts(*astuple(self.counts)), monotonic()
            with contextlib.suppress(OSError):
                self._run.send(_COUNTS.pack(0, *astuple(self.counts)))


def main(words: Sequence[str]) -> int:
    """Carry until the run has gone; the exit status. Signals are the run's."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    run = socket.socket(fileno=int(words[0]))
    run.setblocking(False)
    try:
        carrier = Carrier(run, [int(port) for port in words[1].split(",") if port])
    except OSError as error:
        sys.stderr.write(f"{error.strerror}; expected free ports of {LOOPBACK}: {words[1]}")
        return 2
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while carrier.work():
        pass
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
