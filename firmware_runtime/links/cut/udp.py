"""The UDP carrier of a link: a process of its own between a run and the network.

    run <--pair of Unix sockets--> this process <--UDP--> the other end's carrier <--pair--> run

It is started by the run and ends when the pair of sockets is closed, however that came: by no
signal else, so that the last frames of a run that is stopped still go out. In the place of one that
was killed it says the bye itself, so that the other end need not wait until it is silent. With a
key it signs what goes out and refuses what is not signed; what was seen before, or was meant for
another session of its run, goes no further either. All this is counted and reported to the run.
What passes is judged there once more, by the same rules (`peer`).

One time it wakes it carries `AT_ONCE` datagrams each way at most, and never waits to send.
"""

import argparse
import os
import signal
import socket
import sys
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from select import POLLIN, poll
from time import monotonic_ns
from typing import Final

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.links.cut.counts import Carried, report
from firmware_runtime.links.cut.refusal import Reason, Refused
from firmware_runtime.links.cut.window import Window
from firmware_runtime.links.cut.wire import (
    BYES,
    LONGEST,
    Farewell,
    Frame,
    Kind,
    decoded,
    encode,
    encoded,
    opened,
    sealed,
)
from firmware_runtime.links.endpoint import AT_ONCE, UdpAddress, bound, datagrams, endpoint
from firmware_runtime.links.key_file import read_key

SESSIONS: Final = 16
"""How many sessions of other ends are kept apart; the one that was quiet longest makes room, unless
it is the run's peer."""
GREETINGS_EVERY: Final = 5 * MILLISECOND
"""Ns from one greeting of an end that does not know the run yet to the next that is handed on."""
REPORT_EVERY: Final = 100 * MILLISECOND
_OPTION: Final = "--link"
_DIED: Final = Farewell("its process ended without a word", is_over=False, failed=True)


@dataclass(slots=True)
class _Session:
    """One session of another end: where it is, and which of its frames have come."""

    address: UdpAddress
    window: Window = field(default_factory=Window)


class Carrier:
    """Carries frames between a run and UDP; `peer` is the only address it speaks with, if given."""

    def __init__(
        self, run: socket.socket, udp: socket.socket, key: bytes | None, peer: UdpAddress | None
    ) -> None:
        self._run = run
        self._udp = udp
        self._key = key
        self._peer = peer
        self._latest = peer
        self._own_session = 0
        self._counter = 0
        """Of the latest frame of the run."""
        self._has_parted = False
        """Whether that was a bye."""
        self._peer_session = 0
        """Of the run's peer, which greetings of others do not displace."""
        self._sessions: OrderedDict[int, _Session] = OrderedDict()
        self.carried = Carried(dict.fromkeys(Reason, 0))
        """What it has counted; reported to the run."""
        self._greeted_at = 0
        self._report_at = 0
        self._has_news = False
        self._poll = poll()
        self._poll.register(run, POLLIN)
        self._poll.register(udp, POLLIN)

    def work(self) -> bool:
        """Wait for datagrams and carry them; False once the run has closed its socket."""
        timeout = REPORT_EVERY // MILLISECOND if self._has_news else None
        ready = {descriptor for descriptor, _ in self._poll.poll(timeout)}
        if self._run.fileno() in ready and not self._from_run():
            return False
        if self._udp.fileno() in ready:
            self._from_udp()
        if self._has_news and (now := monotonic_ns()) >= self._report_at:
            self._report_at = now + REPORT_EVERY
            self._report()
        return True

    # From the run ---------------------------------------------------------------------------------

    def _from_run(self) -> bool:
        for _ in range(AT_ONCE):
            try:
                frame = self._run.recv(LONGEST)
            except BlockingIOError:
                break
            except ConnectionResetError:  # the run ended, and had not read all: its byes wait here
                continue
            except OSError:
                return False
            if not frame:
                return False
            self._send(frame)
        return True

    def _send(self, plain: bytes) -> None:
        self._own_session = int.from_bytes(plain[8:16])
        self._counter = int.from_bytes(plain[24:32])
        self._has_parted = plain[4] == Kind.BYE
        receiver = int.from_bytes(plain[16:24])
        if plain[4] != Kind.HELLO:  # which goes to any end that greets
            self._peer_session = receiver
        known = self._sessions.get(receiver)
        address = self._latest if known is None else known.address
        try:
            if address is not None:
                self._udp.sendto(plain if self._key is None else sealed(plain, self._key), address)
                return
        except OSError:  # no room, or no way there at the moment
            pass
        self.carried.unsent += 1
        self._has_news = True

    def part(self) -> None:
        """The run has closed its socket: say a bye in its place, where it has said none."""
        if self._has_parted or self._peer_session == 0:
            return
        body = encode(_DIED)
        for counter in range(self._counter + 1, self._counter + 1 + BYES):
            now = monotonic_ns()
            bye = Frame(Kind.BYE, self._own_session, self._peer_session, counter, now, body=body)
            self._send(encoded(bye))

    # From the network -----------------------------------------------------------------------------

    def _from_udp(self) -> None:
        for datagram, address in datagrams(self._udp, LONGEST + 1):
            self.take(datagram, address)

    def take(self, datagram: bytes, address: UdpAddress) -> None:
        """Judge a datagram that has come, and hand it on to the run."""
        try:
            plain = self._judged(datagram, address)
        except Refused as refusal:
            self.carried.refused[refusal.reason] += 1
            self._has_news = True
            return
        try:
            self._run.send(plain)
        except OSError:
            self.carried.dropped += 1
            self._has_news = True

    def _judged(self, datagram: bytes, address: UdpAddress) -> bytes:
        """Return what goes on to the run. Raises Refused."""
        plain = datagram if self._key is None else opened(datagram, self._key)
        frame = decoded(plain)
        if frame.kind is Kind.REPORT:
            raise Refused(Reason.MALFORMED, "a report comes from no network")
        if self._peer is not None and address[:2] != self._peer[:2]:
            raise Refused(Reason.FORGED, "from another address than the peer's")
        if frame.session == self._own_session:
            raise Refused(Reason.REPLAYED, "a frame of this end itself")
        if frame.peer not in {0, self._own_session}:
            raise Refused(Reason.WRONG_SESSION)
        session = self._sessions.get(frame.session) or self._new(frame, address)
        if self._is_newest(frame, session.window):
            session.address = self._latest = address
        self._sessions.move_to_end(frame.session)
        return plain

    def _new(self, frame: Frame, address: UdpAddress) -> _Session:
        """A session that greets for the first time. Raises Refused."""
        if frame.kind is not Kind.HELLO:
            raise Refused(Reason.WRONG_SESSION, "from a session that has not greeted")
        if (now := monotonic_ns()) - self._greeted_at < GREETINGS_EVERY:
            raise Refused(Reason.WRONG_SESSION, "too many greetings")
        self._greeted_at = now
        if len(self._sessions) >= SESSIONS:
            del self._sessions[next(each for each in self._sessions if each != self._peer_session)]
        made = self._sessions[frame.session] = _Session(address)
        return made

    def _is_newest(self, frame: Frame, window: Window) -> bool:
        """Return whether a frame is newer than all before it. Raises Refused for a repeated one.

        What comes from a sender that is not in order is the run's to refuse: it turns outputs off.
        """
        try:
            window.judge(frame.counter, frame.sent_at)
        except Refused as refusal:
            if refusal.reason is not Reason.WENT_BACK:
                raise
            return False
        return window.accept(frame.counter, frame.sent_at)

    def _report(self) -> None:
        with suppress(OSError):  # no room: the next time, then
            self._run.send(report(self.carried))
            self._has_news = False


# The process --------------------------------------------------------------------------------------


def main() -> int:
    """Carry over UDP."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--listen")
    parser.add_argument("--peer")
    return carry(parser, _udp_carrier)


def carry(
    parser: argparse.ArgumentParser,
    make: Callable[[socket.socket, bytes | None, argparse.Namespace], Carrier],
) -> int:
    """Carry until the run closes its end of the pair, given by the number of a descriptor.

    The process becomes a carrier: no signal ends it, its priority is ordinary.
    """
    parser.add_argument("pair", type=int)
    parser.add_argument("--key", type=Path)
    stated = parser.parse_args()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    if os.sched_getscheduler(0) != os.SCHED_OTHER:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    run = socket.socket(fileno=stated.pair)
    run.setblocking(False)
    try:
        key = None if stated.key is None else read_key(stated.key, _OPTION)
        carrier = make(run, key, stated)
    except ConfigError as error:
        sys.stderr.write(f"{error}\n")
        return Status.BAD_INPUT
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    while carrier.work():
        pass
    carrier.part()
    return Status.OK


def _udp_carrier(run: socket.socket, key: bytes | None, stated: argparse.Namespace) -> Carrier:
    """Raises ConfigError for an address that cannot be had."""
    peer = None if stated.peer is None else endpoint(_OPTION, stated.peer)
    if stated.listen is not None:
        udp = bound(_OPTION, endpoint(_OPTION, stated.listen))
    else:  # at any address that leads to the peer
        family = socket.AF_INET if peer is None else peer.family
        udp = socket.socket(family, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
    return Carrier(run, udp, key, None if peer is None else peer.where)


if __name__ == "__main__":
    sys.exit(main())
