"""The paper's blocks over UDP, with the peers that the paper shows: a ROS node and PowerDEVS."""

import re
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from select import select

import pytest

from firmware_runtime import (
    MILLISECOND,
    Atomic,
    ConfigError,
    Coupled,
    MonotonicClock,
    OpenRun,
    RunState,
    open_model,
    run,
)
from firmware_runtime.links.dover.bridge import DoverBridge
from firmware_runtime.links.dover.dover import DoverBlocks
from firmware_runtime.links.ports.datagrams import message_of
from firmware_runtime.links.ports.ports_client import PortsClient
from firmware_runtime.models.dover import RcvDover, SndDover
from tests.support.linked_runs import free_port
from tests.support.waiting import PATIENCE_S, wait_until

RAMP_STEP = 0.125

PAGE = Path(__file__).parents[2] / "docs" / "bridge.md"


class Ramp(Atomic):
    """Sends 0, 0.125, 0.25, ... every 10 ms (Figure 12)."""

    period = 10 * MILLISECOND

    def __init__(self) -> None:
        super().__init__("ramp")
        self.value = self.out_port("value", float)
        self.steps = 0

    def initialize(self) -> None:
        self.hold_in("rising", self.period)

    def output(self) -> None:
        self.value.send(self.steps * RAMP_STEP)

    def internal(self) -> None:
        self.steps += 1
        self.hold_in("rising", self.period)


class Loop(Coupled):
    """ramp -> snd -> network ... network -> rcv, and a second listener of the same port."""

    def __init__(self, out: int, back: int) -> None:
        super().__init__("loop")
        ramp, inner = self.add(Ramp()), self.add(Coupled("inner"))
        snd = self.add(SndDover("snd", out))
        self.couple(ramp.value, snd.value)
        self.receivers = [self.add(RcvDover("rcv", back)), inner.add(RcvDover("deep", back))]


class RosNode:
    """Figure 9: reads what comes to a port, 18 bytes at most, and here sends it back (Figure 12).

    It answers as sndNET does (Figure 8): by a new socket for each datagram.
    """

    def __init__(self, read_from: int, send_to: int, stack: ExitStack) -> None:
        self.values: list[float] = []
        self._send_to = send_to
        self._socket = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        self._socket.bind(("", read_from))
        self._is_over = threading.Event()
        thread = threading.Thread(target=self._spin)
        thread.start()
        stack.callback(thread.join)
        stack.callback(self._is_over.set)

    def _spin(self) -> None:
        while not self._is_over.is_set():
            for ready in select([self._socket], [], [], 0.001)[0]:
                message, _ = ready.recvfrom(18)
                self.values.append(float(message))
                snd_net(self._send_to, f"{self.values[-1]:f}".encode())


def snd_net(port: int, data: bytes) -> None:
    """Figure 8."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sockfd:
        sockfd.bind(("127.0.0.1", 0))
        sockfd.sendto(data, ("127.0.0.1", port))


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def received_by(opened: OpenRun, block: RcvDover, enough: int) -> list[float]:
    """The values that a block passes on; the run stops when there are enough."""
    values: list[float] = []

    def take(_at: int, value: float) -> None:
        values.append(value)
        if len(values) == enough:
            opened.request_stop("enough")

    opened.listen(block.value, take)
    return values


@pytest.mark.slow
@pytest.mark.real_time
def test_a_ramp_goes_out_to_a_ros_node_and_back_to_all_listeners(stack: ExitStack) -> None:
    out, back = free_port(), free_port()
    loop = Loop(out, back)
    node = RosNode(out, back, stack)
    opened = stack.enter_context(open_model(loop))
    received = [received_by(opened, block, enough=20) for block in loop.receivers]
    result = opened.run(PATIENCE_S)
    assert (result.state, result.reason) == (RunState.STOPPED, "enough")
    assert received[0][:20] == [step * RAMP_STEP for step in range(20)]
    assert received[0][:20] == received[1][:20] == node.values[:20]
    assert opened.dover is not None
    assert opened.dover.dropped == 0


@pytest.mark.slow
@pytest.mark.real_time
def test_what_is_no_number_is_counted_and_reaches_no_model(stack: ExitStack) -> None:
    port = free_port()
    block = RcvDover("rcv", port)
    opened = stack.enter_context(open_model(block))
    values = received_by(opened, block, enough=1)
    for text in (
        b"nan",
        b"inf",
        b"yaw",
        b"",
        b"\xff\0\xff",
        b"1" * 250,
        b"1" * 60_000,
        b"2.500000",
    ):
        snd_net(port, text)
    opened.run(PATIENCE_S)
    assert values == [2.5]
    faults = {kind: each.count for kind, each in opened.statistics.faults["rcv"].items()}
    assert faults == {"NotFinite": 2, "Malformed": 3, "TooLong": 2}


@pytest.mark.slow
@pytest.mark.real_time
@pytest.mark.parametrize("value", [10**400, float("nan"), 1e300, "up", None, [0.5]])
def test_a_value_without_a_number_is_refused_once_and_carrying_goes_on(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, value: object
) -> None:
    offered = ({"name": "n", "direction": "out", "type": "int"},)
    monkeypatch.setattr(PortsClient, "ports", lambda _client: offered)
    said: list[str] = []
    bridge = DoverBridge(tmp_path / "robot.stats", {"n": 62_999}, {}, said.append)
    messages = [message_of(port="n", value=each) for each in (value, value, 7)]
    monkeypatch.setattr(bridge._end, "received", lambda: messages)
    bridge._from_robot()
    bridge.close()
    assert (bridge.refused, bridge.sent) == (2, 1)
    assert len(said) == 1


def test_only_this_machine_is_listened_to(stack: ExitStack) -> None:
    port = free_port()
    stack.enter_context(open_model(RcvDover("rcv", port)))
    assert is_bound("0100007F", port)
    assert not is_bound("00000000", port)


def is_bound(address: str, port: int) -> bool:
    """Whether a UDP socket of this machine has the port of an address, as the kernel writes it."""
    listed = Path("/proc/net/udp").read_text().splitlines()[1:]
    return f"{address}:{port:04X}" in {line.split()[1] for line in listed}


def test_a_port_that_is_taken_is_refused(stack: ExitStack) -> None:
    taken = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    taken.bind(("127.0.0.1", 0))
    with pytest.raises(ConfigError, match=r"DOVER: 127.0.0.1:\d+: Address already in use"):
        open_model(RcvDover("rcv", taken.getsockname()[1]))


def test_in_virtual_time_both_ends_are_one_model() -> None:
    top = Coupled("top")
    ramp = top.add(Ramp())
    snd, rcv = top.add(SndDover("snd", 62002)), top.add(RcvDover("rcv", 62002))
    top.couple(ramp.value, snd.value)
    top.couple(snd.text, rcv.text)
    assert not DoverBlocks(top, MonotonicClock())
    values: list[float] = []
    run(
        top, for_s=0.035, clock="virtual", listen={rcv.value: lambda _, value: values.append(value)}
    )
    assert values == [0.0, 0.125, 0.25]


@pytest.mark.slow
@pytest.mark.real_time
def test_the_two_programs_of_the_page_speak_with_each_other() -> None:
    section = PAGE.read_text().partition("\n## PowerDEVS")[2]
    model, node = re.findall(r"```python\n(.*?)```", section, re.DOTALL)
    out, back = free_port(), free_port()
    model, node = (
        each.replace("62002", str(out)).replace("62001", str(back)) for each in (model, node)
    )
    with subprocess.Popen([sys.executable, "-c", node]) as other:
        try:
            wait_until(lambda: is_bound("0100007F", out), "the node listens")
            printed = subprocess.check_output(
                [sys.executable, "-c", model], text=True, timeout=PATIENCE_S
            )
        finally:
            other.kill()
    values = [float(line.split()[-1]) for line in printed.splitlines()]
    assert values == sorted(values)
    assert values[-1] >= 0.25
