import os
import socket
import subprocess
import threading
from collections.abc import Callable
from functools import partial
from itertools import permutations
from typing import NamedTuple

import pytest

from firmware_runtime.blackbox.state.keyframes import (
    ForeignState,
    StateTable,
    UnkeepableState,
)
from tests.support.nodes import Node


class Pair(NamedTuple):
    left: float
    right: object


def closed_socket() -> socket.socket:
    line = socket.socket()
    line.close()
    return line


REFUSED: dict[str, Callable[[], object]] = {
    "a thread": threading.Thread,
    "a socket within a tuple": lambda: (1, closed_socket()),
    "an iterator in a tuple": lambda: ("a", iter((1, 2))),
    "an iterator of a dictionary": lambda: iter({1: 2}),
    "a socket in a bound method": lambda: closed_socket().close,
    "views with gaps": lambda: memoryview(bytearray(8))[::2],
}


@pytest.mark.parametrize("make", REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_kept_is_named(make: Callable[[], object]) -> None:
    with pytest.raises(UnkeepableState) as caught:
        StateTable({"node": Node(rows=[0, Node(inner=make())])})
    assert caught.value.path.startswith("node.rows[1].inner")


def test_what_was_made_later_and_cannot_be_kept_is_named() -> None:
    node = Node(rows=[1])
    table = StateTable({"node": node})
    node.rows.append({"lock": threading.Lock(), "event": threading.Event()})
    with pytest.raises(UnkeepableState, match=r"lock made during the run") as caught:
        table.capture()
    assert caught.value.path == "node.rows"
    node.rows.pop()
    table.restore(table.capture())


def test_a_function_made_later_in_another_is_refused() -> None:
    node = Node(call=None)
    table = StateTable({"node": node})
    node.call = lambda: 1
    with pytest.raises(UnkeepableState, match="no module holds"):
        table.capture()


def test_edges_stay_as_they_are() -> None:
    with socket.socket() as line:
        log: list[str] = []
        bus = Node(line=line, lock=threading.Lock(), log=log, thread=threading.Thread())
        table = StateTable({"bus": bus}, [line, log, threading.Thread])
        state = table.capture()
        log.append("a line")
        assert list(table.differences(state)) == []
        other, bus.line = bus.line, None
        (found,) = table.differences(state)
        assert found == ("bus.line", other, None)
        table.restore(state)
        assert (bus.line, log) == (line, ["a line"])


def test_what_only_sets_lead_to_has_an_order() -> None:
    def robot() -> StateTable:
        return StateTable({"node": Node(all={Pair(1.0, "a"), Pair(2.0, "b"), "text", 3})})

    assert robot().fingerprint == robot().fingerprint
    with pytest.raises(UnkeepableState, match="another order in every process"):
        StateTable({"node": Node(all={Node(), Node()})})
    node = Node()
    StateTable({"node": Node(list=[node], all={node})})


def test_a_state_of_another_robot_is_refused() -> None:
    one, other = StateTable({"node": Node(value=1)}), StateTable({"node": Node(value=[1])})
    with pytest.raises(ForeignState, match="of another robot"):
        other.restore(one.capture())


def test_a_state_whose_numbers_mean_other_objects_is_refused_as_another_robots() -> None:
    """Read by its numbers alone, some of these name a dictionary as the key of another."""
    nodes = [Node(**{f"field_{index}": {"key": [index]} for index in range(n)}) for n in range(6)]
    tables = [StateTable({"node": node}) for node in nodes]
    states = [table.capture() for table in tables]
    for table, other in permutations(range(len(nodes)), 2):
        with pytest.raises(ForeignState, match="of another robot") as caught:
            tables[table].restore(states[other])
        assert caught.value.is_of_another_robot


def test_a_damaged_state_changes_nothing() -> None:
    node = Node(value=[1.0, Pair(2.0, "text")], other={"key": b"bytes"})
    table = StateTable({"node": node})
    state = table.capture()
    node.value.append(3)
    now = table.capture()
    for place in range(len(state)):
        for content in (
            state[:place],
            state[:place] + bytes([state[place] ^ 0x55]) + state[place + 1 :],
        ):
            try:
                table.restore(content)
            except ForeignState:
                assert list(table.differences(now)) == []
            else:
                table.restore(now)


HOSTILE = {
    "a function by its name": b"\x80\x05cos\nsystem\n(X\x04\x00\x00\x00truetR.",
    "a class": b"\x80\x05\x8c\x0bbuiltins\x8c\x04list\x93.",
    "a known object, called": b"\x80\x05h\x01)R.",
    "a known object, changed": b"\x80\x05h\x01}X\x05\x00\x00\x00valueK\x07sb.",
    "a number too large": b"\x80\x05J\xff\xff\xff\x7fQ.",
    "nothing": b"",
    "text": b"not a pickle at all",
}


@pytest.mark.parametrize("content", HOSTILE.values(), ids=HOSTILE)
def test_nothing_of_a_file_is_run(content: bytes) -> None:
    node = Node(value=1)
    table = StateTable({"node": node})
    with pytest.raises(ForeignState):
        table.restore(content)
    with pytest.raises(ForeignState):
        list(table.differences(content))
    assert vars(node) == {"value": 1}


@pytest.mark.parametrize("function", [os.system, subprocess.Popen])
def test_a_function_of_no_module_of_the_robot_is_not_put_into_it(
    function: Callable[..., object],
) -> None:
    node = Node(call=None)
    table = StateTable({"node": node})
    node.call = partial(function, "true")
    state = table.capture()
    node.call = None
    with pytest.raises(ForeignState, match="no module that the robot is made of"):
        table.restore(state)
    assert node.call is None


def test_what_is_written_as_deep_as_can_be_is_set_back() -> None:
    """Pickle gives up at some depth; until then objects within objects can be made of it."""
    node = Node(inner=None)
    table = StateTable({"node": node})

    def content_of(depth: int) -> bytes | None:
        last = node
        for _ in range(depth):
            last.inner = last = Node(inner=None, rows=[{"up": last}])
        try:
            return table.capture()
        except UnkeepableState:
            return None

    written, refused = 1, 2
    while content_of(refused) is not None:
        written, refused = refused, 2 * refused
    while refused - written > 1:
        middle = (written + refused) // 2
        if content_of(middle) is None:
            refused = middle
        else:
            written = middle
    content = content_of(written)
    assert content is not None
    node.inner = None
    table.restore(content)
    found: Node | None = node
    for _ in range(written):
        assert found is not None
        found = found.inner
    assert written > 20
    assert found is not None
    assert found.inner is None
