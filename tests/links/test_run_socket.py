"""The socket of a run in virtual time: real connections, the loop's own passes."""

import os
import socket
from collections.abc import Iterator
from pathlib import Path
from time import monotonic_ns, time_ns
from typing import Any

import pytest

from firmware_runtime.devs.coupled import Coupled
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.links.ports.datagrams import TIMEOUT
from firmware_runtime.links.ports.outgoing import MOST, RESERVE
from firmware_runtime.links.ports.ports import Ports
from firmware_runtime.links.ports.run_socket import AT_ONCE, RunSocket
from firmware_runtime.models.motion import Motion
from firmware_runtime.statistics.paths import Companion
from tests.support.executives import Run
from tests.support.periodic_models import PERIOD, Robot
from tests.support.ports_rig import PortsRig


@pytest.fixture
def robot() -> Robot:
    return Robot()


@pytest.fixture
def rig(tmp_path: Path, robot: Robot) -> Iterator[PortsRig]:
    with PortsRig(tmp_path / "robot.socket", robot) as rig:
        yield rig


def counts(rig: PortsRig) -> tuple[int, ...]:
    """Received, refused, sent, dropped."""
    return tuple(rig.ports.counts().values())


# Values in --------------------------------------------------------------------------------------


def test_a_value_enters_the_model_as_an_event_of_the_next_pass(rig: PortsRig, robot: Robot) -> None:
    speaker = rig.speaker()
    instants: list[tuple[int, int]] = []
    robot.thrust.work = lambda value: instants.append((rig.run.executive.simulator.now, value))
    robot.imu.work = lambda number: (
        speaker.say({"port": "command", "value": 70 + number}) if number == 1 else None
    )
    rig.run.until(2 * PERIOD)
    assert instants == [(0, 0), (PERIOD, 1), (PERIOD, 71), (2 * PERIOD, 2)]
    assert counts(rig) == (1, 0, 0, 0)


def test_values_keep_their_order_and_none_is_lost(rig: PortsRig, robot: Robot) -> None:
    speaker = rig.speaker()
    said = iter(range(100, 150))

    def say_some(number: int) -> None:
        for value in [next(said) for _ in range(5)]:
            speaker.say({"port": "command", "value": value})
        assert number < 10

    robot.imu.work = say_some
    rig.run.until(9 * PERIOD)
    rig.run.executive.simulator.exit()
    assert [value for value in robot.thrust.received if value >= 100] == list(range(100, 150))


def test_a_value_that_a_run_which_stood_still_finds_is_refused_and_a_new_one_is_taken(
    rig: PortsRig, robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    speaker = rig.speaker()
    speaker.say({"port": "command", "value": 70, "confirm": True})
    later = time_ns() + TIMEOUT + 1
    monkeypatch.setattr("firmware_runtime.links.local_socket.time_ns", lambda: later)
    rig.run.until(PERIOD)
    (answer,) = speaker.received()
    assert answer["error"].startswith("command: sent 2.0 s before it was read; expected a value")
    assert counts(rig) == (1, 1, 1, 0)
    assert 70 not in robot.thrust.received
    monkeypatch.undo()
    speaker.say({"port": "command", "value": 71})
    assert [value for _, value in rig.ports.receive()] == [71]


def test_a_value_that_has_waited_as_long_as_its_sender_waits_is_taken(
    rig: PortsRig, robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    later = time_ns() + TIMEOUT
    rig.speaker().say({"port": "command", "value": 70})
    monkeypatch.setattr("firmware_runtime.links.local_socket.time_ns", lambda: later)
    rig.run.until(PERIOD)
    assert 70 in robot.thrust.received


def test_a_pass_takes_so_many_datagrams_and_no_more(rig: PortsRig) -> None:
    speaker = rig.speaker()
    for number in range(AT_ONCE + 1):
        speaker.say({"port": "command", "value": number})
    assert [value for _, value in rig.ports.receive()] == list(range(AT_ONCE))
    assert [value for _, value in rig.ports.receive()] == [AT_ONCE]
    assert rig.ports.receive() == []


@pytest.mark.parametrize(
    ("datagram", "answer"),
    [
        (
            {"port": "imu.replan", "value": 1},
            "imu.replan: no such input port of the top model; expected one of command, replan",
        ),
        ({"port": "command", "value": 1.5}, "command: not an int: 1.5: expected int"),
        (
            {"watch": ["imu.nothing"]},
            "imu.nothing: no such output port; expected one that `show BOARD --ports` shows",
        ),
        (
            {"watch": ["imu.sampel"]},
            (
                "imu.sampel: no such output port; expected one that `show BOARD --ports` "
                "shows; did you mean imu.sample?"
            ),
        ),
        (b"x" * 20000, "the datagram is too long; expected 16384 bytes at most"),
    ],
)
def test_what_cannot_be_obeyed_is_counted_and_answered(
    rig: PortsRig, robot: Robot, datagram: object, answer: str
) -> None:
    speaker = rig.speaker()
    speaker.say(datagram)
    rig.run.until(PERIOD)
    assert speaker.received() == [{"error": answer}]
    assert counts(rig) == (1, 1, 1, 0)
    assert robot.thrust.received == [0, 1]


class OddPorts(Coupled):
    """Input ports of types that a datagram can bear, and of one that it cannot."""

    def __init__(self) -> None:
        super().__init__("odd")
        self.motion = self.in_port("motion", Motion)
        self.anything = self.in_port("anything", tuple)


def test_a_port_whose_type_says_too_little_is_not_written(tmp_path: Path) -> None:
    with PortsRig(tmp_path / "odd.socket", odd := OddPorts()) as rig:
        speaker = rig.speaker()
        speaker.say({"port": "anything", "value": [1]})
        speaker.say({"port": "motion", "value": {"position": 1, "rate": -0.5}})
        assert rig.ports.receive() == [(odd.motion, Motion(1.0, -0.5))]
        rig.ports.between_steps(0, 2 * RESERVE)
        (received,) = speaker.received()
    assert received == {"error": "anything: a value of tuple cannot be sent; expected another port"}


# Messages out -------------------------------------------------------------------------------------


def test_a_watcher_receives_what_leaves_its_ports(rig: PortsRig) -> None:
    speaker = rig.speaker()
    speaker.say({"watch": ["imu.sample"]})
    rig.run.until(2 * PERIOD)
    assert speaker.received() == [
        {"watching": ["imu.sample"], "for_s": 10},
        {"port": "imu.sample", "t_ns": 0, "value": 0},
        {"port": "imu.sample", "t_ns": PERIOD, "value": 1},
        # that of the last instant would be sent after the step, and there is no time after it
    ]


def test_a_listener_that_ends_is_called_no_more_and_the_port_is_what_it_was(
    rig: PortsRig, robot: Robot
) -> None:
    speaker = rig.speaker()
    robot.imu.work = lambda number: speaker.say({"watch": []}) if number == 2 else None
    speaker.say({"watch": ["imu.sample"]})
    rig.run.until(6 * PERIOD)
    assert [each.get("value") for each in speaker.received()] == [None, 0, 1, 2, None]
    assert robot.imu.sample.listeners == ()


def test_who_has_gone_is_forgotten(rig: PortsRig, robot: Robot) -> None:
    speaker = rig.speaker()
    robot.imu.work = lambda number: speaker.close() if number == 2 else None
    speaker.say({"watch": ["imu.sample"]})
    rig.run.until(6 * PERIOD)
    assert robot.imu.sample.listeners == ()
    assert counts(rig) == (1, 0, 3, 1)


def test_a_reader_that_never_reads_costs_it_its_messages_and_no_other_reader(rig: PortsRig) -> None:
    lazy, eager = rig.speaker(), rig.speaker()
    lazy.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 0)
    for speaker in (lazy, eager):
        speaker.say({"watch": ["imu.sample"]})
    messages: list[Any] = []
    robot = rig.run.executive.simulator.root
    assert isinstance(robot, Robot)
    robot.imu.work = lambda _number: messages.extend(eager.received())
    rig.run.until(2000 * PERIOD)
    assert [each["value"] for each in messages[1:]] == list(range(len(messages) - 1))
    assert len(messages) > 1990
    received, refused, sent, dropped = counts(rig)
    assert (received, refused) == (2, 0)
    assert sent + dropped == 2 * 2000 + 2
    assert dropped >= 2000 - len(lazy.received())


def test_so_many_may_watch_and_the_next_is_answered_why_not(rig: PortsRig) -> None:
    for _ in range(MOST):
        rig.speaker().say({"watch": ["imu.sample"]})
        rig.ports.receive()
    late = rig.speaker()
    late.say({"watch": ["imu.sample"]})
    rig.run.until(PERIOD)
    (received,) = late.received()
    assert f"{MOST} others watch already" in received["error"]


def test_a_loop_without_time_to_spare_reports_nothing_until_it_has_some(rig: PortsRig) -> None:
    speaker = rig.speaker()
    speaker.say({"list": True})
    rig.ports.receive()
    rig.ports.between_steps(0, RESERVE)
    assert speaker.received() == []
    rig.ports.between_steps(0, -MILLISECOND)
    assert speaker.received() == []
    rig.ports.between_steps(0, RESERVE + 1)
    assert len(speaker.received()) == 1


def test_a_value_without_words_ends_nothing(rig: PortsRig, robot: Robot) -> None:
    class Unspeakable(int):
        __slots__ = ()

    speaker = rig.speaker()
    speaker.say({"watch": ["imu.sample"]})
    robot.imu.activations = Unspeakable(7)
    rig.run.until(2 * PERIOD)
    assert [each.get("value") for each in speaker.received()] == [None, 8]
    assert counts(rig)[-2:] == (2, 1)


def test_the_list_names_every_port_and_the_counts(rig: PortsRig) -> None:
    speaker = rig.speaker()
    speaker.say(b"?")
    speaker.say({"list": True})
    rig.run.until(PERIOD)
    _, received = speaker.received()
    assert received == {
        "ports": [
            {"name": "command", "direction": "in", "type": "int"},
            {"name": "replan", "direction": "in", "type": "int"},
            {"name": "imu.sample", "direction": "out", "type": "int"},
        ],
        "counts": {"received": 2, "refused": 1, "sent": 0, "dropped": 0},
    }


# The socket's file --------------------------------------------------------------------------------


def ports_of(robot: Robot, path: Path) -> RunSocket:
    return RunSocket(path, Run(robot, VirtualClock()).executive, Ports(robot))


@pytest.mark.parametrize(
    ("umask", "mode"), [(0, 0o660), (0o002, 0o660), (0o022, 0o640), (0o027, 0o640), (0o077, 0o600)]
)
def test_its_mode_follows_the_umask_and_never_lets_everybody_in(
    tmp_path: Path, robot: Robot, umask: int, mode: int
) -> None:
    before = os.umask(umask)
    try:
        ports = ports_of(robot, tmp_path / "robot.socket")
    finally:
        os.umask(before)
    assert (tmp_path / "robot.socket").stat().st_mode & 0o7777 == mode
    ports.close()


def test_it_is_beside_the_statistics_and_removed_at_the_end(tmp_path: Path, robot: Robot) -> None:
    path = Companion.SOCKET.beside(tmp_path / "robot.stats")
    assert path == tmp_path / "robot.socket"
    ports = ports_of(robot, path)
    assert path.is_socket()
    ports.close()
    ports.close()
    assert not path.exists()


def test_a_later_run_takes_its_place_and_keeps_it(tmp_path: Path, robot: Robot) -> None:
    earlier = ports_of(robot, tmp_path / "robot.socket")
    later = ports_of(Robot(), tmp_path / "robot.socket")
    earlier.close()
    assert (tmp_path / "robot.socket").is_socket()
    later.close()
    assert not (tmp_path / "robot.socket").exists()


def test_a_place_for_no_socket_is_refused_in_a_sentence(tmp_path: Path, robot: Robot) -> None:
    path = tmp_path / ("x" * 120 + ".socket")
    with pytest.raises(ConfigError, match="no socket can be made here"):
        ports_of(robot, path)


def test_the_time_of_the_run_is_said_with_that_of_the_machine(rig: PortsRig) -> None:
    speaker = rig.speaker()
    before = monotonic_ns()
    speaker.say({"time": True})
    rig.run.until(2 * PERIOD)
    (answer,) = speaker.received()
    assert 0 <= answer["t_ns"] <= 2 * PERIOD
    assert before <= answer["monotonic_ns"] <= monotonic_ns()
