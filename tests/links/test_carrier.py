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
from firmware_runtime.links.cut.channel import CarrierChannel, ChannelClosed
from firmware_runtime.links.cut.counts import Carried, report_of
from firmware_runtime.links.cut.refusal import Reason
from firmware_runtime.links.cut.udp import AT_ONCE, Carrier
from firmware_runtime.links.cut.wire import LONGEST, Frame, Kind, decoded, encoded, sealed
from firmware_runtime.links.key_file import read_key, write_key
from tests.support.linked_runs import free_port
from tests.support.waiting import PATIENCE_S

OWN, OTHER = 1, 2
KEY = bytes(range(32))


class Carriage:
    """A carrier of this process, its run's end of the pair, and a socket of the network."""

    def __init__(self, key: bytes | None = KEY) -> None:
        self.key = key
        self.run, pair = socket.socketpair(
            socket.AF_UNIX, socket.SOCK_SEQPACKET | socket.SOCK_NONBLOCK
        )
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        udp.bind(("127.0.0.1", 0))
        self.address = udp.getsockname()
        self.outside = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.outside.bind(("127.0.0.1", 0))
        self.outside.settimeout(PATIENCE_S)
        self.carrier = Carrier(pair, udp, key, None)
        self.held = (self.run, pair, udp, self.outside)
        self.counter = 0
        self.carried = Carried()

    def says(self, frame: Frame) -> None:
        """The run sends a frame."""
        self.run.send(encoded(frame))
        self.carrier.work()

    def comes(self, datagram: bytes) -> None:
        """A datagram comes from the network."""
        self.outside.sendto(datagram, self.address)
        self.carrier.work()

    def frame(self, kind: Kind = Kind.STEP, *, peer: int = OWN, sent_at: int = 0) -> Frame:
        self.counter += 1
        return Frame(kind, OTHER, peer, self.counter, sent_at or self.counter)

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

    def refused(self) -> dict[Reason, int]:
        counted: Carried = self.carrier.carried
        return {reason: count for reason, count in counted.refused.items() if count > 0}


@pytest.fixture
def carriage() -> Iterator[Carriage]:
    made = Carriage()
    made.says(Frame(Kind.HELLO, OWN, 0, 1, 1))
    made.comes(encoded(made.frame(Kind.HELLO, peer=0), KEY))
    assert [each.kind for each in made.passed()] == [Kind.HELLO]
    yield made
    for held in made.held:
        held.close()


def test_what_is_signed_goes_both_ways(carriage: Carriage) -> None:
    frame = carriage.frame()
    carriage.comes(encoded(frame, KEY))
    assert carriage.passed() == [frame]
    answer = Frame(Kind.STEP, OWN, OTHER, 2, 2)
    carriage.says(answer)
    assert carriage.outside.recv(LONGEST) == encoded(answer, KEY)


def test_what_is_not_goes_no_further(carriage: Carriage) -> None:
    sound = carriage.frame()
    for datagram in (encoded(sound), encoded(sound, bytes(32)), b"", b"x" * 200):
        carriage.comes(datagram)
    carriage.comes(bytes(LONGEST + 1))
    assert carriage.passed() == []
    assert carriage.refused() == {Reason.FORGED: 4, Reason.OVERSIZED: 1}


def test_what_came_before_goes_no_further(carriage: Carriage) -> None:
    frame = carriage.frame()
    for _ in range(3):
        carriage.comes(encoded(frame, KEY))
    assert carriage.passed() == [frame]
    carriage.comes(encoded(Frame(Kind.STEP, OWN, OTHER, 9, 9), KEY))
    assert carriage.refused() == {Reason.REPLAYED: 3}, "its own, too"


def test_what_is_meant_for_another_session_goes_no_further(carriage: Carriage) -> None:
    carriage.comes(encoded(carriage.frame(peer=77), KEY))
    carriage.comes(encoded(carriage.frame()._replace(session=78), KEY))
    assert carriage.passed() == []
    assert carriage.refused() == {Reason.WRONG_SESSION: 2}


def test_a_report_comes_from_no_network(carriage: Carriage) -> None:
    carriage.comes(encoded(carriage.frame(Kind.REPORT), KEY))
    assert carriage.passed() == []
    assert carriage.refused() == {Reason.MALFORMED: 1}


def test_the_run_learns_what_was_refused(carriage: Carriage) -> None:
    carriage.comes(b"nonsense")
    while carriage.carrier._has_news:  # at most every 100 ms
        carriage.carrier.work()
    carriage.passed()
    assert carriage.carried.refused[Reason.FORGED] == 1


def test_one_time_it_wakes_it_carries_so_many(carriage: Carriage) -> None:
    for _ in range(2 * AT_ONCE):
        carriage.outside.sendto(encoded(carriage.frame(), KEY), carriage.address)
    carriage.carrier.work()
    assert len(carriage.passed()) == AT_ONCE


def test_what_comes_faster_than_the_run_takes_it_is_dropped_and_counted(
    carriage: Carriage,
) -> None:
    while carriage.carrier.carried.dropped == 0:
        carriage.comes(encoded(carriage.frame(), KEY))
    passed = carriage.passed()
    assert 0 < len(passed) < carriage.counter


def test_it_ends_when_the_run_closes_its_socket(carriage: Carriage) -> None:
    carriage.run.close()
    assert carriage.carrier.work() is False


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
