"""The process of a bad network carries datagrams both ways, loses and delays them by its seed."""

import socket

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.stages.way import PathProcess
from firmware_runtime.links.cut.impaired_path import Decisions, ImpairedPath, Impairment
from firmware_runtime.links.endpoint import Endpoint, bound, endpoint
from tests.support.waiting import PATIENCE_S

LOSSY = Impairment(loss=0.5, seed=3)
ANYWHERE = endpoint("test", "127.0.0.1:0")


def udp() -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind(("127.0.0.1", 0))
    made.settimeout(PATIENCE_S)
    return made


def somewhere() -> socket.socket:
    return bound("test", ANYWHERE)


def at(end: socket.socket) -> Endpoint:
    host, port = end.getsockname()
    return endpoint("test", f"{host}:{port}")


def test_what_is_lost_is_what_the_seed_says() -> None:
    decisions = Decisions(LOSSY, "out")
    expected = [number for number in range(200) if decisions.next()]
    with udp() as controller, udp() as robot:
        path = ImpairedPath(somewhere(), somewhere(), at(robot), LOSSY)
        front = endpoint("test", path.addresses["front"]).where
        for number in range(200):
            controller.sendto(bytes([number]), front)
            path.work()
        arrived = [robot.recv(10)[0] for _ in expected]
        path.close()
    assert arrived == expected
    counts = path.counts["out"]
    assert counts["received"] == counts["sent"] + counts["lost"] == 200


def test_answers_go_back_to_where_the_last_datagram_came_from() -> None:
    with udp() as controller, udp() as robot:
        path = ImpairedPath(somewhere(), somewhere(), at(robot), Impairment())
        controller.sendto(b"there", endpoint("test", path.addresses["front"]).where)
        path.work()
        datagram, back = robot.recvfrom(10)
        robot.sendto(datagram[::-1], back)
        path.work()
        assert controller.recv(10) == b"ereht"
        path.close()


def test_an_answer_before_anything_was_said_is_counted_as_not_sent() -> None:
    with udp() as robot:
        path = ImpairedPath(somewhere(), somewhere(), at(robot), Impairment())
        robot.sendto(b"hello", endpoint("test", path.addresses["back"]).where)
        path.work()
        assert path.counts["back"]["not_sent"] == 1
        path.close()


@pytest.mark.slow
def test_the_process_delays_and_counts_and_ends_with_its_input() -> None:
    how = Impairment(delay=50_000_000, duplicate=1.0)
    with udp() as controller, udp() as robot:
        path = PathProcess("127.0.0.1", str(at(robot)), how)
        controller.sendto(b"there", endpoint("test", path.front).where)
        assert [robot.recv(10), robot.recv(10)] == [b"there", b"there"]
        counts = path.end()
    assert counts["out"] == {
        "received": 1,
        "lost": 0,
        "duplicated": 1,
        "sent": 2,
        "not_sent": 0,
    }
    assert path.end() is counts


@pytest.mark.slow
def test_an_address_that_cannot_be_had_is_a_sentence() -> None:
    with pytest.raises(ConfigError):
        PathProcess("192.0.2.1", "127.0.0.1:9", Impairment())
