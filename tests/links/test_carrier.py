"""A UDP carrier: what it lets through, what it refuses, and when it ends."""

import os
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from select import select
from subprocess import PIPE, Popen

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.links.cut import udp
from firmware_runtime.links.cut.channel import CarrierChannel, ChannelClosed
from firmware_runtime.links.cut.counts import Carried, report_of
from firmware_runtime.links.cut.refusal import Reason
from firmware_runtime.links.cut.udp import GREETINGS_EVERY, SESSIONS, Carrier
from firmware_runtime.links.cut.wire import (
    BYES,
    LONGEST,
    Frame,
    Kind,
    decoded,
    encoded,
    farewell_of,
    opened,
    sealed,
)
from firmware_runtime.links.endpoint import AT_ONCE
from firmware_runtime.links.key_file import read_key, write_key
from sim_doubles.clock import ManualClock
from tests.support.linked_runs import free_port
from tests.support.waiting import PATIENCE_S

OWN, OTHER = 1, 2
KEY = bytes(range(32))


class Carriage:
    """A carrier of this process, its run's end of the pair, and the network's sockets."""

    def __init__(self) -> None:
        self.run, pair = socket.socketpair(
            socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK
        )
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        udp.bind(("127.0.0.1", 0))
        self._address = udp.getsockname()
        self._held = [self.run, pair, udp]
        self.carrier = Carrier(pair, udp, KEY, None)
        self.carried = Carried()
        self.outside = self.end()
        self.counter = 0
        self.says(Frame(Kind.HELLO, OWN, 0, 1, 1))

    def end(self) -> socket.socket:
        """Return another end's socket."""
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        made.connect(self._address)
        made.settimeout(PATIENCE_S)
        self._held.append(made)
        return made

    def says(self, frame: Frame) -> None:
        """The run sends a frame."""
        self.run.send(encoded(frame))
        self.carrier.work()

    def comes(
        self, what: Frame | bytes, end: socket.socket | None = None, key: bytes = KEY
    ) -> list[Frame]:
        """Return the frames that the run gets of what comes from the network."""
        (end or self.outside).send(encoded(what, key) if isinstance(what, Frame) else what)
        self.carrier.work()
        return self.passed()

    def frame(self, kind: Kind = Kind.STEP, *, peer: int = OWN) -> Frame:
        self.counter += 1
        return Frame(kind, OTHER, peer, self.counter, self.counter)

    def passed(self) -> list[Frame]:
        """The frames that the run got, reports aside."""
        found = []
        while select([self.run], (), (), 0)[0]:
            frame = decoded(self.run.recv(LONGEST))
            if frame.kind is Kind.REPORT:
                self.carried = report_of(frame.body)
            else:
                found.append(frame)
        return found

    def part(self) -> None:
        """The run closes its end of the pair: the carrier does what is left to do."""
        self.run.close()
        while self.carrier.work():
            pass
        self.carrier.part()

    def refused(self) -> dict[Reason, int]:
        counted: Carried = self.carrier.carried
        return {reason: count for reason, count in counted.refused.items() if count > 0}

    def close(self) -> None:
        for held in self._held:
            held.close()


def is_silent(end: socket.socket) -> bool:
    """Return whether nothing more has come to another end."""
    return not select([end], (), (), 0)[0]


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> ManualClock:
    """The carrier's clock, by hand."""
    clock = ManualClock(GREETINGS_EVERY)
    monkeypatch.setattr(udp, "monotonic_ns", clock)
    return clock


@pytest.fixture
def fresh() -> Iterator[Carriage]:
    """One whose run has greeted, and knows no other end."""
    made = Carriage()
    yield made
    made.close()


@pytest.fixture
def carriage(fresh: Carriage) -> Carriage:
    """The same, greeted by another end."""
    assert [each.kind for each in fresh.comes(fresh.frame(Kind.HELLO, peer=0))] == [Kind.HELLO]
    return fresh


def test_what_is_signed_goes_both_ways(carriage: Carriage) -> None:
    frame = carriage.frame()
    assert carriage.comes(frame) == [frame]
    answer = Frame(Kind.STEP, OWN, OTHER, 2, 2)
    carriage.says(answer)
    assert carriage.outside.recv(LONGEST) == encoded(answer, KEY)


def test_what_is_not_goes_no_further(carriage: Carriage) -> None:
    sound = carriage.frame()
    for datagram in (
        encoded(sound),
        encoded(sound, bytes(32)),
        b"",
        b"x" * 200,
        bytes(LONGEST + 1),
    ):
        assert carriage.comes(datagram) == []
    assert carriage.refused() == {Reason.FORGED: 4, Reason.OVERSIZED: 1}


def test_what_came_before_goes_no_further(carriage: Carriage) -> None:
    frame = carriage.frame()
    assert [len(carriage.comes(frame)) for _ in range(3)] == [1, 0, 0]
    carriage.comes(Frame(Kind.STEP, OWN, OTHER, 9, 9))
    assert carriage.refused() == {Reason.REPLAYED: 3}, "its own, too"


def test_what_is_meant_for_another_session_goes_no_further(carriage: Carriage) -> None:
    assert carriage.comes(carriage.frame(peer=77)) == []
    assert carriage.comes(carriage.frame()._replace(session=78)) == []
    assert carriage.refused() == {Reason.WRONG_SESSION: 2}


def test_a_report_comes_from_no_network(carriage: Carriage) -> None:
    assert carriage.comes(carriage.frame(Kind.REPORT)) == []
    assert carriage.refused() == {Reason.MALFORMED: 1}


def test_the_run_learns_what_was_refused(carriage: Carriage) -> None:
    carriage.comes(b"nonsense")
    while carriage.carrier._has_news:  # at most every 100 ms
        carriage.carrier.work()
    carriage.passed()
    assert carriage.carried.refused[Reason.FORGED] == 1


def test_one_time_it_wakes_it_carries_so_many(carriage: Carriage) -> None:
    for _ in range(2 * AT_ONCE):
        carriage.outside.send(encoded(carriage.frame(), KEY))
    carriage.carrier.work()
    assert len(carriage.passed()) == AT_ONCE


def test_what_comes_faster_than_the_run_takes_it_is_dropped_and_counted(
    carriage: Carriage,
) -> None:
    while carriage.carrier.carried.dropped == 0:
        carriage.outside.send(encoded(carriage.frame(), KEY))
        carriage.carrier.work()
    assert 0 < len(carriage.passed()) < carriage.counter


def test_recorded_greetings_do_not_displace_the_peer(clock: ManualClock, fresh: Carriage) -> None:
    peer, attacker = fresh.outside, fresh.end()
    assert fresh.comes(Frame(Kind.HELLO, OTHER, 0, 1, 1))
    fresh.says(Frame(Kind.HEARTBEAT, OWN, OTHER, 2, 0))
    for session in range(100, 100 + 3 * SESSIONS):
        clock.advance(GREETINGS_EVERY)
        assert fresh.comes(Frame(Kind.HELLO, session, 0, 1, 1), attacker)
        fresh.says(Frame(Kind.HELLO, OWN, session, 3, 0))
    assert fresh.comes(Frame(Kind.STEP, OTHER, OWN, 2, 2)) != []
    peer.recv(LONGEST)
    fresh.says(Frame(Kind.HEARTBEAT, OWN, OTHER, 4, 0))
    assert peer.recv(LONGEST) == encoded(Frame(Kind.HEARTBEAT, OWN, OTHER, 4, 0), KEY)


def test_greetings_of_many_sessions_are_let_through_one_in_five_milliseconds(
    clock: ManualClock, fresh: Carriage
) -> None:
    passed = [fresh.comes(Frame(Kind.HELLO, 7 + n, 0, 1, 1)) for n in range(50)]
    assert [len(each) for each in passed] == [1, *[0] * 49]
    clock.advance(GREETINGS_EVERY)
    assert fresh.comes(Frame(Kind.HELLO, 99, 0, 1, 1))


# The end of a run ---------------------------------------------------------------------------------


def test_the_last_frames_of_a_run_that_had_not_read_all_still_go_out(fresh: Carriage) -> None:
    fresh.outside.send(encoded(Frame(Kind.HELLO, OTHER, 0, 1, 1), KEY))
    fresh.carrier.work()
    bye = Frame(Kind.BYE, OWN, OTHER, 2, 0)
    fresh.run.send(encoded(bye))
    fresh.part()
    assert fresh.outside.recv(LONGEST) == encoded(bye, KEY)
    assert is_silent(fresh.outside)


def test_for_a_run_that_was_killed_its_carrier_says_the_bye(carriage: Carriage) -> None:
    peer = carriage.outside
    carriage.says(Frame(Kind.HEARTBEAT, OWN, OTHER, 7, 0))
    peer.recv(LONGEST)
    carriage.part()
    byes = [decoded(opened(peer.recv(LONGEST), KEY)) for _ in range(BYES)]
    assert [(each.kind, each.counter) for each in byes] == [(Kind.BYE, 8 + n) for n in range(BYES)]
    assert {(each.session, each.peer) for each in byes} == {(OWN, OTHER)}
    farewell = farewell_of(byes[0].body)
    assert (farewell.is_over, farewell.failed) == (False, True)


def test_a_run_that_had_no_peer_leaves_none(carriage: Carriage) -> None:
    carriage.part()
    assert is_silent(carriage.outside)


# As a process -------------------------------------------------------------------------------------


@contextmanager
def channel(*words: str) -> Iterator[CarrierChannel]:
    made = CarrierChannel("firmware_runtime.links.cut.udp", words)
    try:
        yield made
    finally:
        made.close()


@pytest.mark.slow
def test_it_outlives_signals_and_ends_with_its_pair() -> None:
    with channel("--listen", f"127.0.0.1:{free_port()}") as made:
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            made.process.send_signal(number)
        made.send(encoded(Frame(Kind.HELLO, OWN, 0, 1, 1)))
        assert select([made], (), (), PATIENCE_S)[0], "a report that there is no way yet"
        assert made.process.poll() is None
    assert made.process.returncode == 0


@pytest.mark.slow
def test_it_ends_with_a_run_that_is_killed() -> None:
    starts = (
        "from firmware_runtime.links.cut.channel import CarrierChannel as C; import time;"
        f"c = C('firmware_runtime.links.cut.udp', ['--listen', '127.0.0.1:{free_port()}']);"
        "print(c.process.pid, flush=True); input()"
    )
    with Popen([sys.executable, "-c", starts], stdin=PIPE, stdout=PIPE) as run:
        assert run.stdout is not None
        carrier = int(run.stdout.readline())
        ends = os.pidfd_open(carrier)
        run.kill()
        run.wait()
    assert select([ends], (), (), PATIENCE_S)[0]
    os.close(ends)


@pytest.mark.slow
def test_its_process_says_the_bye_of_a_run_whose_end_of_the_pair_is_closed() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        other.settimeout(PATIENCE_S)
        with channel("--peer", f"127.0.0.1:{other.getsockname()[1]}") as made:
            made.send(encoded(Frame(Kind.HEARTBEAT, OWN, OTHER, 7, 1)))
            assert decoded(other.recv(LONGEST)).kind is Kind.HEARTBEAT
        bye = decoded(other.recv(LONGEST))
    assert (bye.kind, bye.session, bye.peer, bye.counter) == (Kind.BYE, OWN, OTHER, 8)


@pytest.mark.slow
def test_a_carrier_that_is_killed_closes_the_channel() -> None:
    with channel("--listen", f"127.0.0.1:{free_port()}") as made:
        made.process.kill()
        assert select([made], (), (), PATIENCE_S)[0]
        with pytest.raises(ChannelClosed):
            made.receive()


@pytest.mark.slow
def test_an_address_that_is_taken_is_a_sentence(tmp_path: Path) -> None:
    port = free_port()
    write_key(tmp_path / "key")
    with channel("--listen", f"127.0.0.1:{port}", "--key", str(tmp_path / "key")):
        with pytest.raises(ConfigError, match="Address already in use"):
            CarrierChannel("firmware_runtime.links.cut.udp", ["--listen", f"127.0.0.1:{port}"])
        sound = sealed(encoded(Frame(Kind.HELLO, OTHER, 0, 1, 1)), read_key(tmp_path / "key"))
        assert len(sound) < LONGEST
