"""What cannot be kept is named by its path; what stands in a file runs nothing, whatever it is."""

import builtins
import itertools
import os
import socket
import subprocess
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum
from itertools import permutations
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import msgspec
import numpy as np
import pytest

from firmware_runtime.recording.blackbox.state.keyframes import (
    ForeignState,
    StateTable,
    UnkeepableState,
)
from firmware_runtime.recording.values import pack, unpack
from tests.support.nodes import Node


class Pair(NamedTuple):
    left: float
    right: object


class Helper:
    """No record: it has attributes, and functions."""


def closed_socket() -> socket.socket:
    line = socket.socket()
    line.close()
    return line


def within_itself() -> list[object]:
    made: list[object] = []
    made.append(made)
    return made


AT_THE_START: dict[str, Callable[[], object]] = {
    "a thread": threading.Thread,
    "a socket within a tuple": lambda: (1, closed_socket()),
    "an iterator": lambda: iter((1, 2)),
    "a counter": itertools.count,
    "a generator under way": lambda: (each for each in "ab"),
    "a socket in a bound method": lambda: closed_socket().close,
    "an array of objects": lambda: np.array([1, None], dtype=object),
}


class Hashed(NamedTuple):
    number: int

    def __hash__(self) -> int:
        return self.number


LATER: dict[str, Callable[[], object]] = {
    "a lock": threading.Lock,
    "an object of no record": Helper,
    "a function": lambda: lambda: 1,
    "a class": lambda: Helper,
    "a module": lambda: os,
    "a path": lambda: Path("/tmp"),  # noqa: S108 -- not opened
    "an iterator": lambda: iter([1]),
    "an object as a key": lambda: {object(): 1},
    "a key with a hash of its own": lambda: {Hashed(1): 1},
    "a text that UTF-8 has not": lambda: "\udc80",
    "a list within itself": within_itself,
}


@pytest.mark.parametrize("make", AT_THE_START.values(), ids=AT_THE_START)
def test_what_cannot_be_kept_is_named_at_the_start(make: Callable[[], object]) -> None:
    with pytest.raises(UnkeepableState, match=r"state\(\) and restore\(state\)") as caught:
        StateTable({"node": Node(rows=[0, Node(inner=make())])})
    assert caught.value.path.startswith("node.rows[1].inner")


@pytest.mark.parametrize("make", LATER.values(), ids=LATER)
def test_what_was_made_later_and_cannot_be_kept_is_named(make: Callable[[], object]) -> None:
    node = Node(value=None, rows=[1])
    table = StateTable({"node": node})
    node.value = make()
    with pytest.raises(UnkeepableState) as caught:
        table.capture()
    assert caught.value.path == "node.value"
    node.value = None
    node.rows.append([make()])
    with pytest.raises(UnkeepableState) as caught:
        table.capture()
    assert caught.value.path == "node.rows"
    node.rows.pop()
    table.restore(table.capture())


def test_edges_stay_as_they_are() -> None:
    with socket.socket() as line:
        log: list[str] = []
        bus = Node(line=line, lock=threading.Lock(), log=log, thread=threading.Thread())
        table = StateTable({"bus": bus}, [line, log, threading.Thread])
        state = table.capture()
        log.append("a line")
        assert list(table.differences(state)) == []
        bus.line = None
        assert [each.path for each in table.differences(state)] == ["bus.line"]
        table.restore(state)
        assert (bus.line, log) == (line, ["a line"])


def test_a_state_of_another_robot_is_refused() -> None:
    nodes = [Node(**{f"field_{index}": {"key": [index]} for index in range(n)}) for n in range(6)]
    tables = [StateTable({"node": node}) for node in nodes]
    states = [table.capture() for table in tables]
    for table, other in permutations(range(len(nodes)), 2):
        with pytest.raises(ForeignState, match="of another robot") as caught:
            tables[table].restore(states[other])
        assert caught.value.is_of_another_robot


def test_a_damaged_state_changes_nothing() -> None:
    node = Node(value=[1.0, Pair(2.0, "text")], other={"key": b"bytes"}, late=None)
    table = StateTable({"node": node})
    node.late, node.other["more"] = Pair(3.0, [4]), {"deep": {5}}
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


class Proof:
    """What a file has made run."""

    ran: ClassVar[list[str]] = []


@dataclass
class Speaking:
    """A record by its looks, whose functions would say that they have run."""

    word: str = ""

    def __post_init__(self) -> None:
        Proof.ran.append("__post_init__")

    def __repr__(self) -> str:
        Proof.ran.append("__repr__")
        return "spoken"

    def __hash__(self) -> int:
        Proof.ran.append("__hash__")
        return 1

    def __eq__(self, other: object) -> bool:
        Proof.ran.append("__eq__")
        return True

    def __setattr__(self, name: str, value: object) -> None:
        Proof.ran.append("__setattr__")


@dataclass
class Ending:
    word: str = ""

    def __del__(self) -> None:
        Proof.ran.append("__del__")


@dataclass
class Computed:
    word: str = ""
    _word: str = field(default="", init=False)


def _said(_: object, value: str) -> None:
    Proof.ran.append(f"set {value}")


Computed.word = property(lambda _: "", _said)  # type: ignore[assignment]


@dataclass
class Overheard:
    word: str = ""

    def __getattribute__(self, name: str) -> object:
        Proof.ran.append(f"get {name}")
        return super().__getattribute__(name)


class Checked(msgspec.Struct):
    word: str = ""

    def __post_init__(self) -> None:
        Proof.ran.append("__post_init__")


class Told(msgspec.Struct):
    word: str = ""

    def __init_subclass__(cls) -> None:
        Proof.ran.append("__init_subclass__")


class Meta(type):
    def __call__(cls, *given: object) -> object:
        Proof.ran.append("__call__")
        return super().__call__(*given)


@dataclass
class OfMeta(metaclass=Meta):
    word: str = ""


class Answering(Enum):
    ONE = 1

    @classmethod
    def _missing_(cls, value: object) -> Any:  # noqa: ANN401, ARG003 -- as of Enum
        Proof.ran.append("_missing_")
        return cls.ONE


class Process(subprocess.Popen[bytes]):
    """Would end itself as a process."""


here = __name__
DEEP: Any = []
for _ in range(90):
    DEEP = {"list": [DEEP]}
DOUBLED: list[Any] = [{"list": []}]
"""Each holds the one before twice: made in no time, and never gone through."""
for place in range(40):
    DOUBLED = [{"list": [*DOUBLED, {"same": [place]}]}]
HOSTILE: dict[str, Any] = {
    "a function": {"os:system": ["true"]},
    "a class of Python": {"subprocess:Popen": ["true"]},
    "one derived from it": {f"{here}:Process": ["true"]},
    "a name through a module": {f"{here}:os.system": ["true"]},
    "a name of another module": {f"{here}:NamedTuple": []},
    "a record of Python": {"sched:Event": [1, 2, 3, 4, 5, 6]},
    "a plain class": {f"{here}:Helper": []},
    "a record that ends": {f"{here}:Ending": ["x"]},
    "a computed field": {f"{here}:Computed": ["x", "y"]},
    "a field that is read by a function": {f"{here}:Overheard": ["x"]},
    "a class of a class": {f"{here}:OfMeta": ["x"]},
    "told of what derives from it": {f"{here}:Told": ["x"]},
    "too few fields": {f"{here}:Pair": [1.0]},
    "no member": {f"{here}:Answering": [7]},
    "a record as a key": {"dict": [[{f"{here}:Speaking": ["x"]}, 1]]},
    "a record in a set": {"set": [{f"{here}:Speaking": ["x"]}]},
    "a list as a key": {"dict": [[{"list": []}, 1]]},
    "pairs of three": {"dict": [[1, 2, 3]]},
    "values within values": DEEP,
    "twice as much each time": DOUBLED[0],
    "no number": {"int": ["9" * 5000]},
    "a number that calls": {"int": [{"list": []}]},
    "an array of objects": {"array": ["|O", [1], bytes(8)]},
    "an array of a large shape": {"array": ["<f8", [1 << 62], bytes(8)]},
    "an array of a negative shape": {"array": ["<f8", [-1, -1], bytes(8)]},
    "an array of fields": {"array": ["f8,O", [1], bytes(16)]},
    "numbers of no kind": {"numbers": ["Q" * 9, bytes(8)]},
    "numbers of half an item": {"numbers": ["q", bytes(7)]},
    "bytes of a length": {"bytearray": [1 << 40]},
    "a row of a negative length": {"deque": [[1], -1]},
    "a generator of no kind": {"generator": ["Generator", {"dict": []}]},
    "a generator without a state": {"generator": ["PCG64", {"dict": []}]},
    "a generator of Python without words": {"random": [3, b"", None]},
    "what is not made yet": {"same": [3]},
    "what is made of itself": {"list": [{"same": [0]}]},
    "an object that is not there": {"known": [1 << 40]},
    "an object before the first": {"known": [-1]},
    "no tag": {},
    "two tags": {"list": [], "set": []},
    "a tag that is no text": {7: []},
    "an unknown tag": {"call": ["os.system", "true"]},
}


@pytest.mark.parametrize("form", HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_value_does_nothing_and_is_one_sentence(form: object) -> None:
    Proof.ran.clear()
    node = Node(value=None, rows=[1, 2])
    table = StateTable({"node": node})
    node.value = "kept"
    fingerprint, built, forms, aside = unpack(table.capture())
    attributes, rows = next(iter(forms)), 1
    for changed in ({attributes: {"value": form}}, {rows: {"list": [form]}}, {rows: form}):
        content = pack([fingerprint, built, forms | changed, aside])
        with pytest.raises(ForeignState) as caught:
            table.restore(content)
        assert len(str(caught.value).splitlines()) == 1
        with suppress(ForeignState):
            list(table.differences(content))
    assert vars(node) == {"value": "kept", "rows": [1, 2]}
    assert Proof.ran == []


@pytest.mark.parametrize("kind", ["Speaking", "Checked"])
def test_a_record_is_made_and_compared_without_its_functions(kind: str) -> None:
    node = Node(value=None)
    table = StateTable({"node": node})
    fingerprint, built, _, aside = unpack(table.capture())
    forms = {0: {"value": {f"{here}:{kind}": ["x"]}}}
    Proof.ran.clear()
    content = pack([fingerprint, built, forms, aside])
    table.restore(content)
    assert [*table.differences(content)] == []
    node.value = None
    assert [each.path for each in table.differences(content)] == ["node.value"]
    assert Proof.ran == []


NAMES = ["__class__", "__dict__", "__init__", "a.b", "", "no name", 7, None]
SHAPES: list[object] = [None, 7, [], [1], {"list": []}, {0: 7}, {"0": {}}, {99: {}}]


@pytest.mark.parametrize("forms", [*SHAPES, *({0: {name: 1}} for name in NAMES)])
def test_a_state_of_another_shape_and_an_attribute_that_no_model_could_set_are_refused(
    forms: object,
) -> None:
    node = Node(value=None)
    table = StateTable({"node": node})
    fingerprint, built, _, aside = unpack(table.capture())
    with pytest.raises(ForeignState):
        table.restore(pack([fingerprint, built, forms, aside]))
    assert vars(node) == {"value": None}


@pytest.mark.parametrize(
    "content",
    [b"", b"text", b"\x80\x05cos\nsystem\n(X\x04\x00\x00\x00truetR.", b"\x91" * 100_000, b"\xc1"],
)
def test_what_is_no_state_at_all_is_refused(content: bytes) -> None:
    table = StateTable({"node": Node(value=1)})
    with pytest.raises(ForeignState):
        table.restore(content)
    with pytest.raises(ForeignState):
        list(table.differences(content))


def test_no_name_of_python_itself_is_a_value() -> None:
    node = Node(value=None)
    table = StateTable({"node": node})
    fingerprint, built, _, aside = unpack(table.capture())
    for name in vars(builtins):
        for tag in (name, f"builtins:{name}"):
            form: dict[str, list[object]] = {tag: []}
            content = pack([fingerprint, built, {0: {"value": form}}, aside])
            try:
                table.restore(content)
            except ForeignState:
                continue
            assert name in form
            assert type(node.value) in (list, set, dict, frozenset, complex)
