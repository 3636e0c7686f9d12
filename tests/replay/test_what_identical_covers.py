"""A replay is identical where all that left the models was compared; else it says what was not."""

import json
from array import array
from collections import OrderedDict, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import IntEnum
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import msgspec
import numpy as np
import pytest
from firmware_boards.tachobot.allocation import Allocation
from msgspec import Struct

from firmware_runtime.devs.ports import OutPort, Owner, Sent
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import Status
from firmware_runtime.recording.blackbox.reader import kind_of
from firmware_runtime.recording.blackbox.section import Kind, decode
from firmware_runtime.recording.classes import (
    MOST_WORDS,
    NO_WORD,
    NotedClasses,
    ReadClasses,
    compare_classes,
)
from firmware_runtime.recording.replay.difference import NOTHING, Difference
from firmware_runtime.recording.replay.verdict import Verdict, replay
from firmware_runtime.recording.what_if.what_if import Question, answer
from tests.support.allocation import has_attribute
from tests.support.command import Command
from tests.support.recorded import every_section, record, rewrite
from tests.support.replayed import opened

Told = Callable[[], object]


@dataclass
class Sample:
    x: float


class Items(list[Any]):
    pass


class Pair(tuple[Any, ...]):  # noqa: SLOT001 -- so that it can have attributes
    pass


class Point(NamedTuple):
    x: float
    y: float


class Place(NamedTuple):
    east: float
    north: float


class Reading(Struct):
    x: float
    names: Any = ()


class Empty(Struct, frozen=True):
    pass


class Colour(IntEnum):
    RED = 1


class Thing:
    def __init__(self, content: int) -> None:
        self.content = content


def with_attribute(value: Any, content: object) -> Any:  # noqa: ANN401 -- of any class
    value.more = content
    return value


DIFFERENT: dict[str, tuple[Told, Told]] = {
    "tuple and list": (lambda: (1.0, 2.0), lambda: [1.0, 2.0]),
    "in a field": (lambda: Reading(1.0, (1.0,)), lambda: Reading(1.0, [1.0])),
    "deeper": (lambda: Reading(1.0, ((1, 2), (3, 4))), lambda: Reading(1.0, ((1, 2), [3, 4]))),
    "named tuples": (lambda: Point(1.0, 2.0), lambda: Place(1.0, 2.0)),
    "a struct and a dict": (lambda: Reading(1.0), lambda: {"x": 1.0, "names": ()}),
    "dataclass and dict": (lambda: Sample(1.0), lambda: {"x": 1.0}),
    "an enumeration": (lambda: Colour.RED, lambda: 1),
    "one in a tuple": (lambda: (Colour.RED, 2.0), lambda: (1, 2.0)),
    "sets": (lambda: {1, 2}, lambda: frozenset({1, 2})),
    "bytes": (lambda: b"ab", lambda: bytearray(b"ab")),
    "a subclass of list": (lambda: Items([1]), lambda: [1]),
    "ordered": (lambda: OrderedDict(a=1), lambda: {"a": 1}),
    "numbers of numpy": (lambda: np.float64(1.5), lambda: 1.5),
    "complex": (lambda: 1 + 2j, lambda: 3j),
    "deque": (lambda: deque([1]), lambda: deque([2])),
    "a deque and a list": (lambda: deque([1]), lambda: [1]),
    "array": (lambda: array("d", [1]), lambda: array("d", [2])),
}
"""Two values of the same form, of which one was sent in the run, the other in the replay."""

NOT_COMPARED: dict[str, tuple[Told, Told]] = {
    "fraction": (lambda: Fraction(1, 3), lambda: Fraction(2, 3)),
    "path": (lambda: Path("/a"), lambda: Path("/b")),
    "range": (lambda: range(1), lambda: range(2)),
    "namespace": (lambda: SimpleNamespace(x=1), lambda: SimpleNamespace(x=2)),
    "object": (lambda: Thing(1), lambda: Thing(2)),
    "in a list": (lambda: [1.0, Thing(1)], lambda: [1.0, Thing(2)]),
    "attribute of a dataclass": (
        lambda: with_attribute(Sample(1.0), 1),
        lambda: with_attribute(Sample(1.0), 2),
    ),
    "attribute of a list": (
        lambda: with_attribute(Items([1]), 1),
        lambda: with_attribute(Items([1]), 2),
    ),
    "attribute of a tuple": (
        lambda: with_attribute(Pair([1]), 1),
        lambda: with_attribute(Pair([1]), 2),
    ),
    "a time": (lambda: datetime(2026, 1, 1, tzinfo=UTC), lambda: datetime(2026, 1, 1, tzinfo=UTC)),
}
"""Two values whose difference no recording can have."""

SURE: dict[str, Told] = {
    "float": lambda: 0.5,
    "text": lambda: "ab",
    "none": lambda: None,
    "tuple": lambda: (1, 2.0, "a", None),
    "list of records": lambda: [Sample(1.0), Sample(2.0)],
    "dict": lambda: {"a": [1, 2], 3: (4.0,)},
    "set": lambda: {"b", "a"},
    "record": lambda: Reading(1.0, [Colour.RED, 1]),
    "dataclass": lambda: Sample(2.0),
    "numpy": lambda: np.eye(2),
    "huge": lambda: 1 << 70,
}


TOLD: dict[str, Told] = {}
"""What TachoBot's allocation sends beside its forces, by port; of the module, not of a model."""
ERRORS: list[Exception] = []
"""What it raises after some answers."""


@pytest.fixture(autouse=True)
def nothing_told() -> None:
    TOLD.clear()
    ERRORS.clear()


def telling(monkeypatch: pytest.MonkeyPatch, ports: Sequence[str]) -> None:
    """Let TachoBot's allocation send what is TOLD by ports of its own."""
    output = Allocation.output

    def sent(model: Allocation) -> None:
        output(model)
        for port, value in TOLD.items():
            model.out_ports[port].send(value())

    has_attribute(
        monkeypatch, "told", lambda model: [model.out_port(each, object).name for each in ports]
    )
    monkeypatch.setattr(Allocation, "output", sent)


def raising(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let TachoBot's allocation raise the first of ERRORS after some answers."""
    external = Allocation.external

    def raising_late(model: Any, elapsed: int) -> None:  # noqa: ANN401
        external(model, elapsed)
        if ERRORS and model._x_age > SECOND // 2:  # without position commands it grows
            raise ERRORS[0]

    monkeypatch.setattr(Allocation, "external", raising_late)


def recorded_with(monkeypatch: pytest.MonkeyPatch, folder: Path, error: Exception | None) -> Path:
    """Record a run that an error ends, or nothing does."""
    raising(monkeypatch)
    ERRORS[:] = [] if error is None else [error]
    return record(folder / "run.recording", "tachobot", 1.0)


def replayed(path: Path) -> tuple[Verdict, dict[str, Difference]]:
    """The verdict, and the first difference of each field."""
    found: dict[str, Difference] = {}

    def found_first(difference: Difference) -> None:
        found.setdefault(difference.field, difference)

    return replay(*opened(path), listener=found_first), found


def test_what_has_the_same_form_and_is_of_another_class_is_a_difference(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    telling(monkeypatch, list(DIFFERENT))
    TOLD.update({name: first for name, (first, _) in DIFFERENT.items()})
    path = record(tmp_path / "run.recording", "tachobot", 1.0)
    verdict, found = replayed(path)
    assert (verdict.is_identical, found) == (True, {})
    assert verdict.compared == verdict.values
    TOLD.update({name: second for name, (_, second) in DIFFERENT.items()})
    verdict, found = replayed(path)
    assert verdict.is_identical is False
    assert set(found) >= set(DIFFERENT)
    assert {found[name].model for name in DIFFERENT} == {"controller.allocation"}


def test_the_order_of_a_set_is_no_difference_of_a_replay_nor_of_an_open_loop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    telling(monkeypatch, ["set"])
    TOLD["set"] = lambda: {0, 8}
    path = record(tmp_path / "run.recording", "tachobot", 1.0)
    TOLD["set"] = lambda: {8, 0}
    assert [*{0, 8}] != [*{8, 0}]
    verdict, found = replayed(path)
    assert (verdict.is_identical, found) == (True, {})
    open_loop = answer(Question(recording=str(path)))
    assert (open_loop.identical, open_loop.outputs) == (True, {})


@pytest.mark.slow
def test_what_cannot_be_compared_is_counted_and_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    telling(monkeypatch, list(NOT_COMPARED))
    for name, (first, second) in NOT_COMPARED.items():
        TOLD.clear()
        TOLD[name] = first
        path = record(tmp_path / f"{name}.recording", "tachobot", 0.9)
        TOLD[name] = second
        verdict, found = replayed(path)
        assert (verdict.is_identical, found) == (None, {}), name
        assert verdict.compared < verdict.values
        assert name in verdict.not_compared[0]
    ended = command("replay", path, "--json")
    said = json.loads(ended.out)
    assert ended.status == Status.NOT_ALL_COMPARED
    assert said["identical"] is None
    assert said["values"] - said["compared"] == verdict.values - verdict.compared > 0
    assert said["not_compared"] == verdict.not_compared
    ended = command("replay", path)
    assert ended.status == Status.NOT_ALL_COMPARED
    assert f"no difference in {said['compared']} of {said['values']} values" in ended.out
    assert "identical" not in ended.out
    open_loop = command.document("replay", path, "--set", "recording.minutes=0.2")
    assert open_loop["not_compared"] == verdict.not_compared


@pytest.mark.slow
def test_whatever_is_compared_as_a_whole_is_identical_from_a_keyframe_on_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    telling(monkeypatch, list(SURE))
    TOLD.update(SURE)
    path = record(tmp_path / "run.recording", "tachobot", 6)
    for words in ([], ["--from", "5.5"]):
        said = command.document("replay", path, *words)
        assert said["identical"] is True
        assert said["compared"] == said["values"]
        assert said["events"] == said["values"] + said["played_back"]
    test = tmp_path / "test_piece.py"
    stretch = ["--from", "2.5", "--until", "3"]
    assert command("replay", path, "--as-test", test, *stretch).status == Status.OK
    verdict, _ = replayed(test.with_suffix(".recording"))
    assert verdict.is_identical


def test_what_a_world_sent_does_not_count_as_compared(tmp_path: Path) -> None:
    verdict, _ = replayed(record(tmp_path / "run.recording", "tachobot", 1.0))
    assert verdict.values + verdict.played_back == verdict.events
    assert verdict.compared == verdict.values < verdict.events
    assert verdict.played_back > 0
    assert verdict.as_json()["duration_s"] == 1.0


WORN = ValueError("worn out")


@pytest.mark.parametrize(
    ("recorded", "present"),
    [
        *((WORN, each) for each in (KeyError("worn out"), ValueError("out of range"), None)),
        *((WORN, ZeroDivisionError()), (None, WORN)),
    ],
)
def test_a_run_that_fails_otherwise_is_a_difference_with_both_texts(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    recorded: Exception | None,
    present: Exception | None,
) -> None:
    path = recorded_with(monkeypatch, tmp_path, recorded)
    verdict, _ = replayed(path)
    assert (verdict.first, verdict.is_identical) == (None, True)
    ERRORS[:] = [] if present is None else [present]
    verdict, found = replayed(path)
    assert verdict.is_identical is False
    failure = found["failure"]
    for said, error in ((failure.recorded, recorded), (failure.replayed, present)):
        assert ("nothing" if error is None else type(error).__name__) in str(said)
        assert "worn out" in str(said) or error is not WORN


def test_of_a_run_whose_end_does_not_say_what_was_raised_the_reason_is_compared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = recorded_with(monkeypatch, tmp_path, WORN)
    *sections, last = every_section(path)
    end = decode(last)
    del end.extra["raised"], end.extra["in_step"]
    for state, is_identical in ((end.extra["state"], True), ("ended", False)):
        end.extra["state"] = state
        rewrite(path, [*sections, msgspec.msgpack.encode(end)])
        assert replayed(path)[0].is_identical is is_identical


def test_what_is_raised_in_the_last_step_of_a_recording_that_breaks_off_is_a_difference(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = recorded_with(monkeypatch, tmp_path, WORN)
    sections = every_section(path)
    while kind_of(sections[-1]) != Kind.STEP:
        sections.pop()
    rewrite(path, sections)
    verdict, found = replayed(path)
    assert verdict.is_identical is False
    assert found["failure"].recorded == NOTHING


class Noting:
    """Ports by number whose values are noted."""

    def __init__(self) -> None:
        self.sent = Sent()
        self.classes = NotedClasses(self.sent)
        self._ports: dict[int, OutPort[Any]] = {}

    def note(self, sent: Sent) -> list[Any] | None:
        """Send each value by the port before it, in one section; what is noted of that."""
        for number, value in zip(sent[::2], sent[1::2], strict=True):
            if number not in self._ports:
                port = self._ports[number] = OutPort(Owner("model"), str(number), object)
                port.record(number, self.sent, self.classes.unlike)
            self._ports[number].send(value)
        found = self.classes.note()
        self.sent.clear()
        return found


def test_of_a_value_that_a_run_did_not_look_into_the_outside_alone_is_compared() -> None:
    noted, value = f"~{__name__}:Reading(x=_, names=%s)", Reading(1.0, ((1, 2.0), [3]))
    assert compare_classes(noted % "tuple", value)[0] is None
    assert compare_classes(noted % "list", value)[0] is False


def test_classes_are_noted_as_they_change() -> None:
    noted, read = Noting(), ReadClasses()
    for value in (0.5, None, True):
        assert noted.note([3, value]) in ([0, "_"], None)
    assert noted.note([3, 1, 3, 0.5, 3, 2]) == [0, "int", 1, 0, 2, 1]
    assert noted.note([3, 3]) is None
    assert noted.note([5, Empty()]) == [0, f"{__name__}:Empty"]
    assert noted.note([4, Point(1.0, 2.0)]) == [0, f"~{__name__}:Point(x=_, y=_)"]
    assert noted.note([4, Point(1.0, 3.0)]) is None
    changed = noted.note([4, Point((1, Colour.RED), 3.0)])  # type: ignore[arg-type]
    assert changed is not None
    module = __name__
    assert changed[1] == f"{module}:Point(x=tuple[int, {module}:Colour], y=_)"
    read.restart(noted.classes.state())
    assert read.read([3, 4], None) == ["int", changed[1]]
    assert read.state() == noted.classes.state()


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (Reading(1.0, (1.0,)), Reading(1.0, [1.0])),
        (Sample(1.0), with_attribute(Sample(1.0), 1)),
        ((1.0, 2.0), (Colour.RED, 2.0)),
        ([], [Point(1.0, 2.0)]),
        (1, Colour.RED),
    ],
)
def test_what_its_form_does_not_tell_is_looked_at_each_time(first: object, second: object) -> None:
    noted = Noting()
    assert noted.note([4, first]) is not None
    assert noted.note([4, first]) is None
    assert noted.note([4, second]) is not None


class Unreadable:
    """Says that it holds fields, and has none."""

    __dataclass_fields__ = None


def test_a_value_that_cannot_be_looked_at_has_no_word() -> None:
    noted, read = Noting(), ReadClasses()
    changes = [noted.note([3, value]) for value in (1, Unreadable(), 1)]
    assert changes == [[0, "int"], [0, NO_WORD], [0, 0]]
    assert [read.read([3], each) for each in changes] == [["int"], [NO_WORD], ["int"]]


def test_there_is_an_end_to_the_classes_that_are_noted() -> None:
    noted = Noting()
    for count in range(2, MOST_WORDS + 20):
        noted.note([0, [*(["a"] * (count % 97)), *([1] * (count // 97))]])
    assert len(noted.classes.state()["words"]) <= MOST_WORDS + 1


@pytest.mark.parametrize("noted", [[0], [1, "int"], [0, 5], [0, 1.5], {"a": 1}, ["a", "b"]])
def test_notes_that_no_run_makes_are_refused(noted: object) -> None:
    with pytest.raises(ValueError, match="classes of values"):
        ReadClasses().read([7], noted)
