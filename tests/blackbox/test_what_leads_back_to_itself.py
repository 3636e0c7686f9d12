"""Objects made during a run that lead back to themselves, or share what they hold, do so again."""

from collections import OrderedDict, defaultdict, deque
from collections.abc import Callable
from enum import Flag, IntFlag
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

import msgspec
import numpy as np
import pytest

from firmware_runtime.blackbox.state.keyframes import StateTable, UnkeepableState
from tests.support.nodes import Node


class Branch(msgspec.Struct):
    name: str
    leaves: list["Branch"] = []
    parent: "Branch | None" = None


class Word(str):
    """A text with attributes."""

    __slots__ = ("__dict__",)


class Window(deque[int]):
    """A deque of a class of its own."""


class Counted(msgspec.Struct, frozen=True):
    items: list[int]

    def __post_init__(self) -> None:
        self.items.append(len(self.items))


class Fault(Flag):
    HOT = 1
    LOW = 2


class Bits(IntFlag):
    ONE = 1


def branch() -> object:
    root = Branch("root")
    root.leaves.append(Branch("leaf", parent=root))
    return root


def itself() -> object:
    root = Branch("root")
    root.parent = root
    return root


def word() -> object:
    made: Any = Word("a")
    made.all = [made]
    return made


def holding(container: Any, put: Callable[[Any, object], None]) -> object:  # noqa: ANN401
    put(container, Node(owner=container))
    return container


def called() -> object:
    arguments: list[object] = []
    arguments.append(partial(max, arguments))
    return arguments[0]


LEADING_BACK: dict[str, tuple[Callable[[], Any], Callable[[Any], object]]] = {
    "a Struct": (branch, lambda made: made.leaves[0].parent),
    "a Struct that is its own": (itself, lambda made: made.parent),
    "a text": (word, lambda made: made.all[0]),
    "a deque": (lambda: holding(deque(), deque.append), lambda made: made[0].owner),
    "defaults": (
        lambda: holding(defaultdict(list), lambda made, node: made.update(a=node)),
        lambda made: made["a"].owner,
    ),
    "ordered": (
        lambda: holding(OrderedDict(), lambda made, node: made.update(a=node)),
        lambda made: made["a"].owner,
    ),
}


def kept(make: Callable[[], object], **others: object) -> Any:  # noqa: ANN401 -- what was made
    """What is in place of a value, made during the run, that a keyframe had."""
    node = Node(value=None, **others)
    table = StateTable({"node": node})
    node.value = make()
    state = table.capture()
    node.value = None
    table.restore(state)
    assert list(table.differences(state)) == []
    return node.value


@pytest.mark.parametrize(("make", "follow"), LEADING_BACK.values(), ids=LEADING_BACK)
def test_what_led_back_to_itself_does_so_again(
    make: Callable[[], Any], follow: Callable[[Any], object]
) -> None:
    made = kept(make)
    assert follow(made) is made


def test_a_struct_is_made_without_what_it_does_when_it_is_made() -> None:
    assert kept(lambda: Counted([7])).items == [7, 1]


def test_a_deque_of_a_class_of_its_own_stays_as_long_as_it_may_be() -> None:
    assert kept(lambda: Window([1, 2, 3], 3)).maxlen == 3
    assert kept(lambda: Window([1, 2, 3])).maxlen is None


@pytest.mark.parametrize("value", [Fault.HOT | Fault.LOW, Fault(0), Fault.LOW, Bits(9), Bits(8)])
def test_members_of_a_flag_together_come_back(value: Flag) -> None:
    found = kept(lambda: value, kinds=[Fault.HOT, Bits.ONE])
    assert (type(found), found.value) == (type(value), value.value)


def missing_file() -> object:
    try:
        return Path("/no/such/file").stat()
    except OSError as error:
        error.add_note("seen")
        return error


def test_an_error_says_again_what_it_said() -> None:
    error = kept(missing_file)
    assert (error.filename, error.__notes__) == ("/no/such/file", ["seen"])
    assert kept(lambda: StopIteration(3)).value == 3
    assert str(kept(lambda: UnicodeDecodeError("utf-8", b"\xff", 0, 1, "no"))).startswith("'utf-8'")


def test_an_error_that_says_more_than_can_be_kept_is_refused() -> None:
    with pytest.raises(UnkeepableState, match="ImportError made during the run"):
        kept(lambda: ImportError("no", name="module"))


@pytest.mark.parametrize("path", [Path("/a/b"), PurePosixPath("c")])
def test_a_path_is_kept_without_what_hash_said_of_it_in_this_process(path: Path) -> None:
    first, second = StateTable({"at": [path]}), StateTable({"at": [type(path)(path)]})
    hash(path)
    assert list(second.differences(first.capture())) == []
    assert kept(lambda: {path: 1}) == {path: 1}


def test_views_of_an_array_share_its_numbers_again() -> None:
    def views() -> object:
        whole = np.zeros((2, 3), order="F")
        return [whole[1:], whole.T[::-1], whole]

    row, turned, whole = kept(views)
    whole[1, 0], turned[0, 0] = 1.0, 2.0
    assert row.tolist() == [[1.0, 0.0, 0.0]]
    assert whole.tolist() == [[0.0, 0.0, 2.0], [1.0, 0.0, 0.0]]


def test_a_view_of_an_array_from_before_is_one_of_that_again() -> None:
    before = np.zeros(4)
    found = kept(lambda: before[1:3], before=before)
    before[1] = 5.0
    assert found.tolist() == [5.0, 0.0]


def test_a_view_is_compared_by_its_numbers_whoever_else_holds_its_array() -> None:
    node = Node(view=None, whole=None)
    table = StateTable({"node": node})
    node.whole = np.arange(4.0)
    node.view = node.whole[1:3]
    shared = table.capture()
    node.view, node.whole = np.arange(4.0)[1:3], np.arange(4.0)
    assert list(table.differences(shared)) == []
    node.view[0] = 7.0
    assert [each.path for each in table.differences(shared)] == ["node.view"]


def test_an_array_over_other_memory_is_refused() -> None:
    memory = bytearray(8)
    with pytest.raises(UnkeepableState, match="over memory of a memoryview"):
        kept(lambda: np.frombuffer(memory), memory=memory)
