"""Input ports of one end of a robot in two processes: a value for the other end is sent there."""

import pytest
from msgspec import Raw

from firmware_runtime.board.ends import end_of, robot_of
from firmware_runtime.board.registry import load
from firmware_runtime.links.ports.datagrams import Refusal
from firmware_runtime.links.ports.ports import Ports


def test_a_port_of_the_other_end_is_refused_with_that_end() -> None:
    board = load("tachobot")
    whole = board.unconnected()
    _, part = robot_of(end_of(board, "robot"), whole)
    here = Ports(whole.model).of_part(part, "tachobot.controller")
    with pytest.raises(Refusal, match=r"expected `send tachobot\.controller yaw_reference=VALUE`"):
        here.arrival("yaw_reference", Raw(b"1.0"))
    with pytest.raises(Refusal, match="no such input port of the top model, which has none here"):
        here.arrival("nothing", Raw(b"1.0"))
