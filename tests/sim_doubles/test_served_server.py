"""The server of doubles on real sockets, step by step in this process; and what is none."""

import json
from collections.abc import Iterator
from pathlib import Path
from socket import AF_UNIX, SOCK_SEQPACKET, socket
from threading import Thread
from typing import Any

import pytest

from firmware_runtime.board import registry
from firmware_runtime.executive.clocks import FURTHEST_AHEAD
from firmware_runtime.hal.served.connection import Connection, lock_of
from firmware_runtime.hal.served.packets import (
    LONGEST,
    Answer,
    Answered,
    Done,
    Look,
    Question,
    Refused,
    Standing,
    Transfer,
    encode,
    read_answer,
)
from firmware_runtime.hal.wire_errors import BusAbsent, BusFault, BusInUse, BusTimeout
from firmware_runtime.system import resources
from sim_doubles.rigs.board_rig import rig_for
from sim_doubles.served import server
from sim_doubles.served.logs import OutputLog, ServingError
from sim_doubles.served.server import DoublesServer, RealClock, listen, unlisten
from sim_doubles.served.service import DoublesService
from tests.support.waiting import PATIENCE_S

WHO_AM_I = Transfer("i2c1", 0x68, (b"\x75", 1))


class Rig:
    """A server of TachoBot's doubles that works on request."""

    def __init__(self, folder: Path) -> None:
        self.path, self.log_path = folder / "doubles.sock", folder / "doubles.log"
        self.clock = RealClock()
        doubles = rig_for(registry.load("tachobot"), self.clock)
        self.log = OutputLog(self.log_path, doubles)
        service = DoublesService("tachobot", doubles, self.clock, self.log)
        self.server = DoublesServer(self.path, service, self.log, self.clock)

    def client(self) -> socket:
        client = socket(AF_UNIX, SOCK_SEQPACKET)
        client.settimeout(PATIENCE_S)
        client.connect(str(self.path))
        self.server.step()
        return client

    def ask(self, client: socket, packet: bytes) -> Answered:
        client.send(packet)
        self.server.step()
        return read_answer(client.recv(LONGEST)).answered

    def events(self, what: str) -> list[dict[str, Any]]:
        lines = (json.loads(line) for line in self.log_path.read_text().splitlines())
        return [line for line in lines if line.get("event") == what]


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    rig = Rig(tmp_path)
    with rig.log, rig.server:
        yield rig


def test_clients_are_answered_each_on_its_own_and_stay_when_another_goes(rig: Rig) -> None:
    with rig.client() as first:
        with rig.client() as second:
            first.send(b"\xff\x00")  # which is no question
            rig.server.step()
            refusal = read_answer(first.recv(LONGEST))
            assert (refusal.number, type(refusal.answered)) == (0, Refused)
            assert rig.ask(first, encode(Question(1, WHO_AM_I))) == Done(b"\x71")
            standing = rig.ask(second, encode(Question(1, Look())))
            assert isinstance(standing, Standing)
            assert (standing.board, standing.outputs) == ("tachobot", {"thrust_pairs": 0})
        rig.server.step()
        assert [each["client"] for each in rig.events("connected")] == [1, 2]
        assert [each["client"] for each in rig.events("gone")] == [2]
        assert rig.ask(first, encode(Question(2, WHO_AM_I))) == Done(b"\x71")


def test_a_client_that_takes_no_answers_is_sent_away(rig: Rig) -> None:
    with rig.client() as deaf, rig.client() as other:
        for number in range(10_000):
            deaf.send(encode(Question(number, WHO_AM_I)))
            rig.server.step()
            if rig.events("gone"):
                break
        assert [each["client"] for each in rig.events("gone")] == [1]
        assert rig.ask(other, encode(Question(1, WHO_AM_I))) == Done(b"\x71")


def test_a_client_that_writes_without_end_does_not_run_the_doubles_ahead_of_the_clock(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    takes_a_tenth_of_a_second = Transfer("i2c1", 0x68, (b"\x75", 4_500))
    with rig.client() as client:
        real = rig.clock.look()
        monkeypatch.setattr(server, "monotonic_ns", lambda: rig.clock.started_at + real)
        for number in range(10):
            assert isinstance(
                rig.ask(client, encode(Question(number, takes_a_tenth_of_a_second))), Done
            )
    assert rig.clock() == real + FURTHEST_AHEAD
    later = real + 10 * FURTHEST_AHEAD
    monkeypatch.setattr(server, "monotonic_ns", lambda: rig.clock.started_at + later)
    assert rig.clock.look() == later  # real time has caught up


# The path ----------------------------------------------------------------------------------------


def test_stop_ends_serving_and_takes_the_path_away_and_who_comes_later_finds_none(
    tmp_path: Path,
) -> None:
    rig = Rig(tmp_path)
    with rig.log, rig.server:
        with pytest.raises(ServingError, match="another server listens here"):
            listen(rig.path)
        connection = Connection(rig.path)
        rig.server.step()
        rig.server.stop()
        rig.server.serve()
        assert rig.path.is_socket()
    assert not rig.path.exists()
    assert not lock_of(rig.path).exists()
    with pytest.raises(BusAbsent, match="have gone"):
        connection.ask(Look(), "doubles")
    with pytest.raises(BusAbsent, match="doubles serve BOARD --socket"):
        Connection(rig.path)


def test_who_does_not_say_how_long_to_wait_is_told_at_once_that_nothing_is_served(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(resources, "sleep", lambda _span_s: pytest.fail("it waits"))
    with pytest.raises(BusAbsent, match="doubles serve BOARD --socket"):
        Connection(tmp_path / "doubles.sock")


def test_a_path_that_a_dead_server_left_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "doubles.sock"
    listen(path).close()
    assert path.is_socket()
    unlisten(listen(path), path)
    assert not path.exists()
    with pytest.raises(ServingError, match="the log cannot be written"):
        OutputLog(tmp_path / "no" / "log", rig_for(registry.load("tachobot"), RealClock()))


@pytest.mark.parametrize("name", ["no/such/folder", "x" * 200, "notes"])
def test_a_path_that_cannot_be_had_is_refused_and_a_file_there_left_alone(
    tmp_path: Path, name: str
) -> None:
    notes = tmp_path / "notes"
    notes.write_text("keep me")
    with pytest.raises(ServingError, match="expected a free path"):
        listen(tmp_path / name)
    assert notes.read_text() == "keep me"


# The client's side -------------------------------------------------------------------------------


def test_an_answer_that_comes_too_late_is_not_taken_for_the_next_one(tmp_path: Path) -> None:
    path = tmp_path / "doubles.sock"
    listener = listen(path)
    connection = Connection(path, answer_s=0.01)
    server, _ = listener.accept()
    with pytest.raises(BusTimeout, match="no answer"):
        connection.ask(WHO_AM_I, "i2c1")
    server.send(encode(Answer(1, Done(b"late"))))
    server.send(encode(Answer(2, Done(b"in time"))))
    assert connection.ask(WHO_AM_I, "i2c1") == Done(b"in time")
    connection.close()
    server.close()
    unlisten(listener, path)


def test_one_drives_the_doubles_and_when_it_is_gone_another_may(rig: Rig) -> None:
    first, second = Connection(rig.path), Connection(rig.path)
    first.keep_others_out()
    with pytest.raises(BusInUse, match="driven by another process"):
        second.keep_others_out()
    first.close()
    lock_of(rig.path).unlink()
    third = Connection(rig.path)
    third.keep_others_out()
    third.close()


@pytest.fixture(params=[b"\xff\xfe", b"\x91" * 3000, b"{}"], ids=["bytes", "deep", "other"])
def impostor(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Path]:
    """Answers whatever it is asked with the same bytes."""
    path = tmp_path / "impostor"
    with socket(AF_UNIX, SOCK_SEQPACKET) as listening:
        listening.bind(str(path))
        listening.listen()

        def serve() -> None:
            connection, _ = listening.accept()
            with connection:
                connection.recv(4096)
                connection.send(request.param)

        thread = Thread(target=serve)
        thread.start()
        yield path
        thread.join()


def test_an_answer_that_is_none_is_an_error_of_the_bus(impostor: Path) -> None:
    connection = Connection(impostor, answer_s=PATIENCE_S)
    with pytest.raises(BusFault, match="i2c1 0x40"):
        connection.ask(Look(), "i2c1 0x40")
    connection.close()
