"""The UDP carrier against what does not come from its peer."""

import socket
from collections.abc import Iterator

import pytest

from firmware_runtime.links.cut import udp
from firmware_runtime.links.cut.udp import GREETINGS_EVERY, SESSIONS, Carrier
from firmware_runtime.links.cut.wire import BYES, Frame, Kind, decoded, encoded, farewell_of, opened
from sim_doubles.clock import ManualClock
from tests.support.waiting import PATIENCE_S

KEY = bytes(range(32))
OWN, PEER = 1, 2


class Rig:
    """A carrier between a run and a network, both of them sockets of the test."""

    def __init__(self, clock: ManualClock) -> None:
        self.clock = clock
        self.run, to_run = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        to_network = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        to_network.bind(("127.0.0.1", 0))
        self.where = to_network.getsockname()
        self.sockets = [self.run, to_run, to_network]
        for each in self.sockets:
            each.setblocking(False)
        self.carrier = Carrier(to_run, to_network, KEY, None)

    def end(self) -> socket.socket:
        """Another end's socket."""
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        made.connect(self.where)
        made.settimeout(PATIENCE_S)
        self.sockets.append(made)
        return made

    def from_network(self, end: socket.socket, frame: Frame) -> list[Frame]:
        """What the run gets of a frame that comes."""
        end.send(encoded(frame, KEY))
        self.carrier.work()
        return [each for each in self.received() if each.kind is not Kind.REPORT]

    def from_run(self, frame: Frame) -> None:
        self.run.send(encoded(frame))
        self.carrier.work()

    def received(self) -> Iterator[Frame]:
        while True:
            try:
                yield decoded(self.run.recv(16384))
            except BlockingIOError:
                return


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    clock = ManualClock(GREETINGS_EVERY)
    monkeypatch.setattr(udp, "monotonic_ns", clock)
    rig = Rig(clock)
    rig.from_run(Frame(Kind.HELLO, OWN, 0, 1, 0))
    yield rig
    for each in rig.sockets:
        each.close()


def test_recorded_greetings_do_not_displace_the_peer(rig: Rig) -> None:
    peer, attacker = rig.end(), rig.end()
    assert rig.from_network(peer, Frame(Kind.HELLO, PEER, 0, 1, 1))
    rig.from_run(Frame(Kind.HEARTBEAT, OWN, PEER, 2, 0))
    for session in range(100, 100 + 3 * SESSIONS):
        rig.clock.advance(GREETINGS_EVERY)
        assert rig.from_network(attacker, Frame(Kind.HELLO, session, 0, 1, 1))
        rig.from_run(Frame(Kind.HELLO, OWN, session, 3, 0))
    assert rig.from_network(peer, Frame(Kind.STEP, PEER, OWN, 2, 2)) != []
    peer.recv(16384)
    rig.from_run(Frame(Kind.HEARTBEAT, OWN, PEER, 4, 0))
    assert peer.recv(16384) == encoded(Frame(Kind.HEARTBEAT, OWN, PEER, 4, 0), KEY)


def test_greetings_of_many_sessions_are_let_through_one_in_five_milliseconds(rig: Rig) -> None:
    attacker = rig.end()
    passed = [rig.from_network(attacker, Frame(Kind.HELLO, 7 + n, 0, 1, 1)) for n in range(50)]
    assert [len(each) for each in passed] == [1, *[0] * 49]
    rig.clock.advance(GREETINGS_EVERY)
    assert rig.from_network(attacker, Frame(Kind.HELLO, 99, 0, 1, 1))


def test_a_report_comes_from_no_network(rig: Rig) -> None:
    assert rig.from_network(rig.end(), Frame(Kind.REPORT, PEER, OWN, 1, 1)) == []


def test_the_last_frames_of_a_run_that_had_not_read_all_still_go_out(rig: Rig) -> None:
    peer = rig.end()
    peer.send(encoded(Frame(Kind.HELLO, PEER, 0, 1, 1), KEY))
    rig.carrier.work()
    bye = Frame(Kind.BYE, OWN, PEER, 2, 0)
    rig.run.send(encoded(bye))
    rig.run.close()
    while rig.carrier.work():
        pass
    rig.carrier.part()
    assert peer.recv(16384) == encoded(bye, KEY)
    peer.setblocking(False)
    with pytest.raises(BlockingIOError):
        peer.recv(16384)


def test_for_a_run_that_was_killed_its_carrier_says_the_bye(rig: Rig) -> None:
    peer = rig.end()
    rig.from_network(peer, Frame(Kind.HELLO, PEER, 0, 1, 1))
    rig.from_run(Frame(Kind.HEARTBEAT, OWN, PEER, 7, 0))
    peer.recv(16384)
    rig.run.close()
    while rig.carrier.work():
        pass
    rig.carrier.part()
    byes = [decoded(opened(peer.recv(16384), KEY)) for _ in range(BYES)]
    assert [(each.kind, each.counter) for each in byes] == [(Kind.BYE, 8 + n) for n in range(BYES)]
    assert {(each.session, each.peer) for each in byes} == {(OWN, PEER)}
    farewell = farewell_of(byes[0].body)
    assert (farewell.is_over, farewell.failed) == (False, True)


def test_a_run_that_had_no_peer_leaves_none(rig: Rig) -> None:
    peer = rig.end()
    rig.from_network(peer, Frame(Kind.HELLO, PEER, 0, 1, 1))
    rig.run.close()
    while rig.carrier.work():
        pass
    rig.carrier.part()
    peer.setblocking(False)
    with pytest.raises(BlockingIOError):
        peer.recv(16384)
