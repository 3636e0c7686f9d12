"""The bridge in this process, without a run, or with what answers in its place."""

import json
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.errors import ConfigError
from firmware_runtime.links.bridge import bridge as bridge_module
from firmware_runtime.links.bridge.bridge import MOST, MOST_OF_ADDRESS, POLL_EVERY, QUIET, Bridge
from firmware_runtime.links.bridge.broadcast import Route
from firmware_runtime.links.bridge.signatures import Acquaintance
from firmware_runtime.links.endpoint import endpoint
from firmware_runtime.links.ports.datagrams import RENEW_EVERY
from firmware_runtime.links.ports.robot_end import ROOM
from firmware_runtime.statistics.paths import Companion
from sim_doubles.clock import ManualClock
from tests.support.replies import Replies
from tests.support.waiting import PATIENCE_S, wait_until

KEY = bytes(range(32))
LOOPBACK = endpoint("--listen", "127.0.0.1:0")


class Rig:
    """A bridge, what it logs, and the UDP sockets that speak with it; time stands still."""

    def __init__(self, path: Path, clock: ManualClock, key: bytes | None = None) -> None:
        self.path = path
        self.socket = Companion.SOCKET.beside(path)
        self.clock = clock
        self.reported: list[str] = []
        self.peer = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.peer.bind(("127.0.0.1", 0))
        peer_at = endpoint("--peer", f"127.0.0.1:{self.peer.getsockname()[1]}")
        route = Route(path, LOOPBACK, peers=[peer_at], watch=["imu.sample"], every=2, key=key)
        self.bridge = Bridge(route, self.reported.append)
        self.sockets = [self.peer]
        self._stack = ExitStack()

    def speaker(self, own: str = "127.0.0.1") -> socket.socket:
        host, _, port = self.bridge.listens_at.rpartition(":")
        speaker = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        speaker.bind((own, 0))
        speaker.settimeout(PATIENCE_S)
        speaker.connect((host, int(port)))
        self.sockets.append(speaker)
        return speaker

    def robot(self) -> Replies:
        """What a run would be; the bridge's own end has asked it to watch."""
        self._stack.enter_context(robot := Replies(self.path))
        self.until(robot)
        return robot

    def until(self, robot: Replies) -> None:
        """Let the bridge carry what has come, until something has come to the robot."""

        def has_come() -> bool:
            self.clock.advance(POLL_EVERY)
            self.bridge.work()
            return robot.has_request()

        wait_until(has_come, "the bridge carries")

    def carried(
        self, robot: Replies, speaker: socket.socket, what: bytes, arrives: bytes = b""
    ) -> socket.socket:
        """Say what no other says, and wait until it has come; the way back to the bridge."""
        self.say(speaker, what)
        found: list[socket.socket] = []

        def has_come() -> bool:
            self.bridge.work()
            found.extend(back for said, back in robot.taken() if said == (arrives or what))
            return bool(found)

        wait_until(has_come, f"{what!r} has come")
        return found[0]

    def say(self, speaker: socket.socket, what: bytes) -> None:
        """Send, and let the bridge carry what has come until then."""
        speaker.send(what)
        self.bridge.work()

    def poll(self, after: int, speaker: socket.socket) -> None:
        """Let time pass, then the bridge look around; something to read ends its wait."""
        self.clock.advance(after)
        self.say(speaker, b"{}")

    def close(self) -> None:
        self.bridge.close()
        self._stack.close()
        for each in self.sockets:
            each.close()


@pytest.fixture
def rig(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    yield from opened_rig(tmp_path, monkeypatch)


@pytest.fixture
def keyed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    yield from opened_rig(tmp_path, monkeypatch, KEY)


def opened_rig(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, key: bytes | None = None
) -> Iterator[Rig]:
    clock = ManualClock(1)
    monkeypatch.setattr(bridge_module, "monotonic_ns", clock)
    rig = Rig(tmp_path / "robot.stats", clock, key)
    yield rig
    rig.close()


def test_a_sender_learns_that_there_is_no_run(rig: Rig) -> None:
    speaker = rig.speaker()
    rig.say(speaker, b'{"list": true}')
    error = "no run listens (No such file or directory); expected one to be alive"
    assert json.loads(speaker.recv(4096)) == {"error": error}
    assert rig.bridge.summary == "no run; senders 1, to it 0, from it 1, dropped 1"


def test_datagrams_go_to_the_run_and_back_as_they_are(rig: Rig) -> None:
    robot, speaker = rig.robot(), rig.speaker()
    assert robot.requests() == ['{"watch":["imu.sample"],"every":2}']
    rig.carried(robot, speaker, b"anything \xff").send(b"something else")
    rig.bridge.work()
    assert speaker.recv(4096) == b"something else"
    assert rig.bridge.summary == "a run listens; senders 1, to it 1, from it 1, dropped 0"


@pytest.mark.parametrize("request_", ["arm", "disarm", "set", "renew"])
def test_a_request_to_the_run_itself_is_not_carried(rig: Rig, request_: str) -> None:
    """Who may write to the bridge is anybody, and the bridge is the run's own user's."""
    robot, speaker = rig.robot(), rig.speaker()
    robot.requests()
    rig.say(speaker, json.dumps({"request": request_}).encode())
    assert "a bridge carries no requests" in json.loads(speaker.recv(4096))["error"]
    rig.carried(robot, speaker, b"{}")
    assert not robot.has_request()


def test_peers_get_messages_but_neither_acknowledgements_nor_refusals(rig: Rig) -> None:
    robot = rig.robot()
    _, bridge = robot.next()
    for message in (
        b'{"watching":["imu.sample"],"for_s":10}',
        b'{"error":"no"}',
        b'{"error":"no"}',
        b'{"port":"imu.sample","t_ns":0,"value":1}',
    ):
        bridge.send(message)
    rig.bridge.work()
    assert rig.peer.recv(4096) == b'{"port":"imu.sample","t_ns":0,"value":1}'
    assert (
        rig.reported
        == [
            f"{rig.socket}: no run listens (No such file or directory); waiting for one",
            f"{rig.socket}: a run listens",
            "the run refuses: no",
        ][-len(rig.reported) :]
    )


def test_the_run_is_asked_again_before_it_forgets_and_the_next_one_at_once(rig: Rig) -> None:
    robot, speaker = rig.robot(), rig.speaker()
    robot.requests()
    rig.clock.advance(RENEW_EVERY)
    rig.say(speaker, b"{}")
    rig.until(robot)
    assert any("watch" in each for each in robot.requests())
    robot.close()
    for _ in range(2):
        rig.poll(POLL_EVERY, speaker)
    robot = rig.robot()
    assert "watch" in robot.requests()[0]
    assert rig.reported[-3:] == [
        f"{rig.socket}: a run listens",
        f"{rig.socket}: no run listens (No such file or directory); waiting for one",
        f"{rig.socket}: a run listens",
    ]


def test_a_run_that_greets_nobody_loses_what_is_said_to_it(rig: Rig) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as stopped:
        stopped.bind(str(rig.socket))
        stopped.listen()
        speaker = rig.speaker()
        for _ in range(ROOM + 3):
            rig.say(speaker, b"?")
    assert rig.bridge.summary.endswith(f"to it {ROOM}, from it 0, dropped 3")


def test_an_address_with_many_ports_has_so_many_places_and_no_more(rig: Rig) -> None:
    rig.robot()
    for _ in range(MOST_OF_ADDRESS + 3):
        rig.clock.advance(1)
        rig.say(rig.speaker(), b"?")
    assert f"; senders {MOST_OF_ADDRESS} (3 displaced), " in rig.bridge.summary
    rig.clock.advance(QUIET + 1)
    rig.say(rig.speaker(), b"?")
    assert "; senders 1 (" in rig.bridge.summary


def test_a_sender_at_another_address_finds_a_place_beside_a_flood_of_ports(rig: Rig) -> None:
    robot, other = rig.robot(), rig.speaker("127.0.0.2")
    for _ in range(MOST + 1):
        rig.clock.advance(1)
        rig.say(rig.speaker(), b"?")
    rig.carried(robot, other, b"mine").send(b"yours")
    rig.bridge.work()
    assert other.recv(4096) == b"yours"


def test_with_a_key_what_is_not_signed_is_dropped_and_never_answered(keyed: Rig) -> None:
    robot, speaker, stranger = keyed.robot(), keyed.speaker(), keyed.speaker()
    sender = Acquaintance(KEY)
    keyed.say(speaker, sender.hello(keyed.clock()))
    assert sender.believe(speaker.recv(4096), keyed.clock()) is None
    signed = sender.ask(b"mine", keyed.clock())
    for datagram in (b'{"port": "yaw_reference", "value": 9}', signed[:-1], signed, signed):
        keyed.say(stranger if datagram is not signed else speaker, datagram)
    said: list[str] = []

    def has_come() -> bool:
        keyed.bridge.work()
        said.extend(robot.requests())
        return "mine" in said

    wait_until(has_come, "what is signed has come")
    assert [each for each in said if "watch" not in each] == ["mine"]
    stranger.setblocking(False)
    with pytest.raises(BlockingIOError):
        stranger.recv(4096)
    refused = "refused 4 (forged 1, malformed 1, replayed 1, unacquainted 1)"
    assert keyed.bridge.summary.endswith(f"to it 1, from it 1, dropped 0, {refused}")


def test_with_a_key_answers_are_signed_for_the_one_who_asked(keyed: Rig) -> None:
    robot, speaker = keyed.robot(), keyed.speaker()
    sender = Acquaintance(KEY)
    keyed.say(speaker, sender.hello(keyed.clock()))
    sender.believe(speaker.recv(4096), keyed.clock())
    signed = sender.ask(b"mine", keyed.clock())
    keyed.carried(robot, speaker, signed, arrives=b"mine").send(b"yours")
    keyed.bridge.work()
    assert sender.believe(speaker.recv(4096), keyed.clock()) == b"yours"


# Addresses and options ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "family", "written", "is_loopback"),
    [
        ("127.0.0.1:7300", socket.AF_INET, "127.0.0.1:7300", True),
        ("0.0.0.0:1", socket.AF_INET, "0.0.0.0:1", False),
        ("[::1]:7300", socket.AF_INET6, "[::1]:7300", True),
        ("[::]:65535", socket.AF_INET6, "[::]:65535", False),
    ],
)
def test_addresses_are_ipv4_or_ipv6(
    text: str, family: socket.AddressFamily, written: str, *, is_loopback: bool
) -> None:
    read = endpoint("--listen", text)
    assert (read.family, str(read), read.is_loopback) == (family, written, is_loopback)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "7300",
        ":7300",
        "127.0.0.1",
        "::1:7300",
        "127.0.0.1:70000",
        "127.0.0.1:\N{SUPERSCRIPT TWO}",
    ],
)
def test_anything_else_is_no_address(text: str) -> None:
    with pytest.raises(ConfigError, match=r"expected ADDRESS:PORT, such as 127.0.0.1:7300"):
        endpoint("--peer", text)


@pytest.mark.parametrize("name", ["a..b", "a" * 64 + ".b"])
def test_what_can_be_no_name_is_no_address(name: str) -> None:
    with pytest.raises(ConfigError, match="no host name; expected an address"):
        endpoint("--listen", f"{name}:7300")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--listen", "nowhere"], "nowhere: expected ADDRESS:PORT"),
        (["--peer", "127.0.0.1:9"], "one without the other; expected both or neither"),
        (["--watch", "imu.sample"], "one without the other; expected both or neither"),
        (["--every", "2"], "stands without --watch"),
        (["--every", "0"], "expected a whole number from 1 to 1000000"),
        (["--listen", "0.0.0.0:0"], "0.0.0.0:0 is open to other machines; expected --key FILE"),
        (["--listen", "[::]:0"], "[::]:0 is open to other machines; expected --key FILE"),
        (["--key", "/nowhere/robot.key"], "--key: /nowhere/robot.key: No such file"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    capsys: pytest.CaptureFixture[str], words: list[str], sentence: str
) -> None:
    try:
        status = main(["bridge", "tachobot", *words])
    except SystemExit as exit_:
        status = int(exit_.code or 0)
    assert (status, sentence in capsys.readouterr().err) == (2, True)


def test_an_address_that_is_taken_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        where = f"127.0.0.1:{taken.getsockname()[1]}"
        words = ["--listen", where, "--statistics", tmp_path / "robot.stats"]
        assert main(["bridge", "tachobot", *map(str, words)]) == 2
    assert f"{where}: Address already in use" in capsys.readouterr().err
