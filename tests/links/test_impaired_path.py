"""A bad network is what its option says, the same for the same seed, and carries both ways."""

import socket

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.stages.way import PathProcess
from firmware_runtime.links.cut.impaired_path import (
    Decisions,
    ImpairedPath,
    Impairment,
    impairment,
)
from firmware_runtime.links.endpoint import Endpoint, bound, endpoint
from tests.support.waiting import PATIENCE_S

BAD = Impairment(
    delay=80 * MILLISECOND,
    jitter=10 * MILLISECOND,
    loss=0.02,
    reorder=0.01,
    duplicate=0.005,
    seed=7,
)


def test_the_option_says_every_part_of_it() -> None:
    text = "delay=80ms,jitter=10ms,loss=2%,reorder=1%,duplicate=0.5%,seed=7"
    assert impairment(text) == BAD
    assert str(BAD) == text


@given(
    st.builds(
        Impairment,
        delay=st.integers(100, 1000).map(lambda ms: ms * MILLISECOND),
        jitter=st.integers(0, 100).map(lambda ms: ms * MILLISECOND),
        loss=st.integers(0, 100).map(lambda percent: percent / 100),
        seed=st.integers(0, (1 << 53) - 1),
    )
)
def test_what_is_written_is_read_again(how: Impairment) -> None:
    assert impairment(str(how)) == how


@pytest.mark.parametrize(
    ("text", "faults"),
    [
        ("", 1),
        ("delay=80", 1),
        ("delay=-1ms,loss=2", 2),
        ("delay=nanms", 1),
        ("loss=101%", 1),
        ("jitter=2ms,delay=1ms", 1),
        ("delya=80ms", 1),
        ("seed=-1,loss=1%,loss=2%", 2),
        ("delay=11s,loss=x%,what", 3),
    ],
)
def test_all_faults_are_listed_at_once(text: str, faults: int) -> None:
    with pytest.raises(ConfigError) as refused:
        impairment(text)
    assert len(refused.value.faults) == faults


def test_the_same_seed_makes_the_same_decisions() -> None:
    one, again = Decisions(BAD, "out"), Decisions(BAD, "out")
    made = [one.next() for _ in range(2000)]
    assert made == [again.next() for _ in range(2000)]
    back = Decisions(BAD, "back")
    assert made != [back.next() for _ in range(2000)]


def test_what_happens_to_one_datagram_does_not_depend_on_the_shares_of_others() -> None:
    worse = Decisions(Impairment(delay=BAD.delay, jitter=BAD.jitter, loss=0.5, seed=7), "out")
    better = Decisions(Impairment(delay=BAD.delay, jitter=BAD.jitter, seed=7), "out")
    pairs = [(worse.next(), better.next()) for _ in range(500)]
    assert all(lossy in ((), sound) for lossy, sound in pairs)


def test_shares_and_delays_are_about_what_was_asked() -> None:
    decisions = Decisions(BAD, "out")
    made = [decisions.next() for _ in range(20_000)]
    delays = [delay for copies in made for delay in copies]
    assert 0.015 < sum(copies == () for copies in made) / len(made) < 0.025
    assert 0.003 < sum(len(copies) == 2 for copies in made) / len(made) < 0.008
    assert 0.005 < sum(delay == 0 for delay in delays) / len(delays) < 0.015
    late = [delay for delay in delays if delay > 0]
    assert min(late) >= BAD.delay - BAD.jitter
    assert max(late) <= BAD.delay + BAD.jitter


# As a path, and as a process ----------------------------------------------------------------------

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
