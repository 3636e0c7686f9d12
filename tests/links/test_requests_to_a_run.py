"""Requests to a run by its socket: who may make them, and how late they count."""

import json
import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from time import time_ns

import pytest

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ControlError
from firmware_runtime.hal.peer import Credentials
from firmware_runtime.links import control
from firmware_runtime.links.control import SLOW_PATIENCE, Answer, Request, ask, post
from firmware_runtime.links.ports.run_socket import AT_ONCE, MOST, MOST_OF_OTHERS
from tests.support.periodic_models import PERIOD, Robot
from tests.support.ports_rig import PortsRig, Speaker
from tests.support.waiting import PATIENCE_S

NEEDS = SECOND // 100
AS_ANOTHER = """
import os, socket, sys
os.setgroups([])
os.setgid(65534)
os.setuid(65534)
with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as own:
    own.connect(sys.argv[1])
    print("connected", flush=True)
    own.recv(100)
    own.send(b'{"request": "quick"}')
    print(own.recv(1000).decode(), flush=True)
"""


class Asked(PortsRig):
    """A run that is asked; its loop passes when the test says so."""

    def __init__(self, path: Path) -> None:
        self.seen: list[Request] = []
        self.robot = Robot()
        answers = dict.fromkeys(("quick", "slow", "slower", "disarm"), self._note)
        slow = dict.fromkeys(("slow", "slower"), NEEDS)
        super().__init__(path, self.robot, answers=answers, slow=slow)
        self.socket = self.ports

    def _note(self, request: Request) -> Answer:
        self.seen.append(request)
        return {"refused": []}

    def say(self, speaker: Speaker, what: object) -> None:
        speaker.say(what)
        self.socket.receive()


@pytest.fixture
def asked(tmp_path: Path) -> Iterator[Asked]:
    with Asked(tmp_path / "x.socket") as found:
        yield found


def test_a_slow_request_waits_for_time_enough(asked: Asked) -> None:
    speaker = asked.speaker()
    asked.socket.between_steps(0, 0)
    asked.say(speaker, {"request": "slow", "values": 1})
    asked.socket.between_steps(0, NEEDS - 1)
    assert asked.seen == []
    asked.socket.between_steps(0, NEEDS)
    assert asked.seen == [{"values": 1}]
    assert speaker.received() == [{"refused": []}]


def test_a_loop_that_never_has_time_enough_answers_a_slow_request_all_the_same(
    asked: Asked,
) -> None:
    asked.say(asked.speaker(), {"request": "slow"})
    asked.socket.between_steps(0, 0)
    asked.socket.between_steps(SLOW_PATIENCE - 1, 0)
    assert asked.seen == []
    asked.socket.between_steps(SLOW_PATIENCE, 0)
    assert asked.seen == [{}]


def test_slow_requests_that_wait_are_refused_by_name(asked: Asked) -> None:
    speaker = asked.speaker()
    asked.say(speaker, {"request": "slow"})
    asked.socket.between_steps(0, 0)
    asked.socket.desk.refuse_waiting("quick", "another name")
    asked.socket.desk.refuse_waiting("slow", "too late")
    asked.socket.between_steps(0, SECOND)
    assert asked.seen == []
    assert speaker.received() == [{"refused": ["too late"]}]
    asked.say(speaker, {"request": "slow"})
    asked.socket.between_steps(SLOW_PATIENCE, 0)
    assert asked.seen == []


def test_a_slow_request_behind_a_refused_one_waits_as_long_as_any(asked: Asked) -> None:
    speaker = asked.speaker()
    for name in ("slow", "slower"):
        asked.say(speaker, {"request": name})
    asked.socket.between_steps(0, 0)
    asked.socket.desk.refuse_waiting("slow", "too late")
    for now in (SLOW_PATIENCE, 2 * SLOW_PATIENCE - 1):
        asked.socket.between_steps(now, 0)
    assert asked.seen == []
    asked.socket.between_steps(2 * SLOW_PATIENCE, 0)
    assert asked.seen == [{}]


def test_an_unknown_request_is_refused(asked: Asked) -> None:
    speaker = asked.speaker()
    asked.say(speaker, {"request": "no"})
    assert "quick, slow" in speaker.received()[0]["refused"][0]


def test_a_flood_of_requests_costs_the_loop_one_answer_a_pass(asked: Asked) -> None:
    speaker = asked.speaker()
    for _ in range(5):
        speaker.say({"request": "quick"})
    for passes in range(1, 6):
        assert asked.socket.receive() == []
        assert len(asked.seen) == passes


def test_one_process_that_floods_it_keeps_no_other_out(asked: Asked) -> None:
    flood, other = asked.speaker(), asked.speaker()
    for number in range(10 * AT_ONCE):
        flood.say({"port": "command", "value": number})
    other.say({"request": "disarm"})
    arrivals = asked.socket.receive()
    assert asked.seen == [{}]
    assert len(arrivals) < AT_ONCE


def test_of_what_was_said_before_the_run_came_to_it_only_disarm_is_obeyed(asked: Asked) -> None:
    """How long it has waited, while the run stood still, cannot be known."""
    stranger = asked.stranger()
    for what in ({"request": "quick"}, {"port": "command", "value": 9}, {"request": "disarm"}):
        stranger.say(what)
    assert asked.socket.receive() == []
    assert asked.seen == [{}]
    assert stranger.received() == [{"greets": "firmware-runtime"}]
    asked.run.until(PERIOD)
    assert 9 not in asked.robot.thrust.received


def test_what_is_posted_counts_though_its_sender_has_gone(tmp_path: Path) -> None:
    asked = Asked(tmp_path / "x.socket")
    post(tmp_path / "x.stats", "disarm")
    asked.socket.receive()
    assert asked.seen == [{}]
    speaker = asked.stranger()
    asked.socket.receive()
    speaker.say({"request": "disarm"})
    speaker.close()  # it has not read that it was greeted
    asked.socket.receive()
    assert asked.seen == [{}, {}]
    asked.close()


def test_a_request_that_says_for_how_long_it_is_waited_for_has_no_effect_later(
    asked: Asked, monkeypatch: pytest.MonkeyPatch
) -> None:
    speaker = asked.speaker()
    for within_s in (1.0, "soon", -(10**400)):
        speaker.say({"request": "quick", "within_s": within_s})
    later = time_ns() + 2 * SECOND
    monkeypatch.setattr("firmware_runtime.links.local_socket.time_ns", lambda: later)
    for expected in ("still waited for", "expected seconds", "expected seconds"):
        asked.socket.receive()
        assert expected in speaker.received()[0]["refused"][0]
    assert asked.seen == []


@pytest.mark.skipif(os.geteuid() != 0, reason="becoming another user takes root")
def test_a_user_that_may_write_to_it_may_not_arm_or_disarm(asked: Asked) -> None:
    folder = asked.path.parent
    for each in (folder, *folder.parents):
        if each.owner() == "root" and each.stat().st_mode & 0o005 == 0:
            each.chmod(0o755)
    asked.path.chmod(0o666)
    words = [sys.executable, "-c", AS_ANOTHER, str(asked.path)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "connected\n"
        asked.socket.receive()
        while not asked.socket.counts()["received"]:
            asked.socket.receive()
        (refused,) = json.loads(process.stdout.readline())["refused"]
        process.wait(PATIENCE_S)
    assert "user 65534" in refused
    assert "expected the user of that run, or root" in refused
    assert asked.seen == []


@pytest.mark.parametrize(("user", "most"), [(os.geteuid(), MOST), (65534, MOST_OF_OTHERS)])
def test_there_is_room_for_so_many_and_the_others_are_sent_away(
    asked: Asked, monkeypatch: pytest.MonkeyPatch, user: int, most: int
) -> None:
    monkeypatch.setattr(
        "firmware_runtime.links.local_socket.peer_of", lambda _: Credentials(1, user, user)
    )
    speakers = [asked.stranger() for _ in range(most)]
    for _ in range(most):
        asked.socket.read_next()
    late = asked.stranger()
    asked.socket.read_next()
    assert late.socket.recv(100) == b""
    speakers[0].close()
    asked.socket.read_next()
    again = asked.stranger()
    asked.socket.read_next()
    assert len(again.received()) == 1


def test_a_run_without_a_descriptor_left_takes_others_again_once_one_has_gone(
    asked: Asked,
) -> None:
    speaker = asked.speaker()
    late = asked.stranger()
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (0, limits[1]))
    try:
        assert asked.socket.read_next()
        assert not asked.socket.read_next()
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)
    speaker.close()
    assert asked.socket.read_next()
    assert asked.socket.read_next()
    assert late.received() == [{"greets": "firmware-runtime"}]


def test_the_end_of_one_run_leaves_the_socket_of_the_next(tmp_path: Path) -> None:
    first, second = Asked(tmp_path / "x.socket"), Asked(tmp_path / "x.socket")
    first.close()
    assert second.path.is_socket()
    second.close()
    assert not second.path.exists()


# The asking end -----------------------------------------------------------------------------------


def test_a_request_without_a_run_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(ControlError, match="expected a run that listens there"):
        ask(tmp_path / "x.stats", "arm")


def test_a_run_that_does_not_answer_is_asked_to_disarm_all_the_same(
    asked: Asked, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(control, "TIMEOUT_S", 0.01)
    for request in ("quick", "disarm"):
        with pytest.raises(ControlError, match="no answer within"):
            ask(asked.path.with_suffix(".stats"), request)
    for _ in range(4):
        asked.socket.receive()
    assert asked.seen == [{}]
