"""Values of a run and its replay: a set has another order in each process, all else its own."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import pytest
from msgspec import Raw, Struct, msgpack

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.recording.blackbox.layout import file_of
from firmware_runtime.recording.blackbox.reader import damage
from firmware_runtime.recording.blackbox.section import Kind, Section, decode, encode_sent, sent_of
from firmware_runtime.recording.replay.difference import NOTHING, Difference
from firmware_runtime.recording.replay.section_comparison import (
    ComparedValues,
    differences_of_counts,
    is_same_but_for_order,
)
from firmware_runtime.recording.replay.verdict import replay, verdict_document
from tests.support.recorded import every_section, in_chunks, record, recording_in, rewrite
from tests.support.replayed import opened, replayed


@dataclass
class Seen:
    names: object
    count: int = 1


class Told(Struct):
    names: object


class Listed(Struct, array_like=True, tag="listed"):
    names: object
    count: int = 1


class Renamed(Struct, rename="camel", tag_field="kind", tag="renamed", omit_defaults=True):
    all_names: object
    how_many: int = 1


@pytest.mark.parametrize(
    ("value", "form"),
    [
        ({"a", "b"}, ["b", "a"]),
        (frozenset({1, 2.0, None}), [None, 2.0, 1]),
        (({"a", "b"}, 1), [["b", "a"], 1]),
        ({"names": {"a", "b"}}, {"names": ["b", "a"]}),
        (Seen({"a", "b"}), {"names": ["b", "a"], "count": 1}),
        (Told({"a", "b"}), {"names": ["b", "a"]}),
        (Listed({"a", "b"}), ["listed", ["b", "a"], 1]),
        (Renamed({"a", "b"}), {"kind": "renamed", "allNames": ["b", "a"]}),
        ({frozenset({"a", "b"}), frozenset({"c", "d"})}, [["d", "c"], ["b", "a"]]),
        ({("x", frozenset({"a", "b"})), "y"}, ["y", ["x", ["b", "a"]]]),
        ({frozenset({"a", "b"}): 1}, {("b", "a"): 1}),
    ],
)
def test_the_order_of_a_set_is_no_difference(value: object, form: object) -> None:
    assert is_same_but_for_order(value, form)
    swapped = msgpack.decode(msgpack.encode(value))
    assert is_same_but_for_order(value, swapped)


@pytest.mark.parametrize(
    ("value", "form"),
    [
        ({"a", "b"}, ["a", "c"]),
        ({"a", "b"}, ["a"]),
        ({"a"}, "a"),
        (["a", "b"], ["b", "a"]),
        ({"x": 1, "y": 2}, {"y": 2, "x": 1}),
        ({0.0}, [-0.0]),
        ({1}, [1.0]),
        (Seen({"a"}), {"names": ["a"], "count": 2}),
        (Seen({"a"}), {"names": ["a"], "other": 1}),
        (1.0, 1),
        (Listed({"a"}), ["other", ["a"], 1]),
        (Listed({"a", "b"}), ["listed", ["b", "a"], 2]),
        (Renamed({"a", "b"}, 2), {"kind": "renamed", "allNames": ["b", "a"]}),
        (Renamed({"a", "b"}), {"kind": "renamed", "allNames": ["b", "a"], "howMany": 2}),
        ({frozenset({"a", "b"}), frozenset({"c", "d"})}, [["d", "c"], ["b", "c"]]),
        ({frozenset({"a", "b"}), "c"}, [["b", "a"], ["a", "b"]]),
        ({frozenset({"a", "b"}): 1}, {("b", "a"): 2}),
    ],
)
def test_anything_else_is_one(value: Any, form: Any) -> None:  # noqa: ANN401 -- whatever is sent
    assert not is_same_but_for_order(value, form)


# What is compared and counted --------------------------------------------------------------------


def sent(*recorded: object) -> Section:
    return Section(Kind.STEP, 7, [], [], [], [], Raw(encode_sent([*recorded])), [], [])


def value(model: str, port: str, recorded: object, replayed: object) -> Difference:
    return Difference(7, "value", model, port, recorded, replayed)


@pytest.mark.parametrize(
    ("recorded", "replayed", "differences", "counted"),
    [
        ((0, 0.5, 1, 1.0, 2, 3.0), [0, 0.5, 1, 1.0, 2, 3.0], [], (2, 1)),
        ((0, 0.5, 1, 1.0), [0, 0.6, 1, 1.0], [value("imu", "sample", 0.5, 0.6)], (2, 0)),
        ((0, {"a"}), [0, {"a"}], [], (1, 0)),
        (
            (0, 0.5, 2, 3.0),
            [2, 3.0],
            [value("imu", "sample", 0.5, NOTHING), value("world", "place", 3.0, NOTHING)],
            (1, 1),
        ),
        ((), [1, 0.5], [value("pwm", "duty", NOTHING, 0.5)], (0, 0)),
        ((3, 0.5), [], [value("", "port 3", 0.5, NOTHING)], (1, 0)),
    ],
    ids=["the same", "another number", "a set", "from another port", "one more", "unknown port"],
)
def test_values_are_compared_in_the_order_in_which_they_left_and_counted_once(
    recorded: tuple[object, ...],
    replayed: list[Any],
    differences: list[Difference],
    counted: tuple[int, int],
) -> None:
    compared = ComparedValues(["imu.sample", "pwm.duty", "world.place"], frozenset({2}))
    assert list(compared.differences(sent(*recorded), replayed)) == differences
    assert (compared.values, compared.played_back) == counted
    assert compared.compared + len(list(compared.not_compared())) == compared.values


def test_values_whose_classes_are_unknown_are_named_by_their_number_the_most_first() -> None:
    compared = ComparedValues([f"imu.p{n}" for n in range(13)], frozenset())
    compared.restart()
    for number in range(13):
        for _ in range(2 if number == 4 else 1):
            assert list(compared.differences(sent(number, ["a"]), [number, ["a"]])) == []
    found = list(compared.not_compared())
    assert found[0].startswith("2 values of imu.p4: ")
    assert found[1].startswith("1 value of imu.p0: ")
    assert found[10:] == ["3 other values"]
    assert (compared.values, compared.compared) == (14, 0)


def test_counts_that_differ_are_named_by_model_and_name() -> None:
    recorded = {"imu": {"run": 3, "late": 1}, "gone": {"run": 1}}
    replayed = {"imu": {"run": 3, "late": 2}, "new": {"run": 1}}
    assert list(differences_of_counts(7, recorded, replayed)) == [
        Difference(7, "count", "imu", "late", 1, 2),
        Difference(7, "count", "gone", "run", 1, NOTHING),
    ]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """The recording of a run of 50 ms."""
    return record(tmp_path / "run.recording", "detective", 0.05)


def test_a_replay_counts_all_that_it_compares(path: Path) -> None:
    verdict = replayed(path)
    assert verdict.is_identical
    assert verdict.duration == 50 * MILLISECOND
    assert verdict.values == verdict.compared > 0
    assert (verdict.unknown, verdict.uncompared, verdict.failure) == (0, 0, None)
    document = verdict_document(opened(path)[0], verdict, 10 * MILLISECOND)
    assert document["times_real_time"] == 5.0


def test_a_value_that_is_recorded_otherwise_is_the_first_difference(path: Path) -> None:
    heard: list[Difference] = []
    sections = [decode(each) for each in every_section(path)]
    of_steps = (each for each in sections if each.kind is Kind.STEP)
    changed = next(each for each in of_steps if sent_of(each))
    (number, was), *others = sent_of(changed)
    changed.sent = Raw(
        encode_sent([number, "another", *(part for pair in others for part in pair)])
    )
    rewrite(path, [msgspec.msgpack.encode(each) for each in sections])
    verdict = replay(*opened(path), listener=heard.append)
    assert heard[0] == verdict.first
    assert len(heard) == verdict.differences
    assert verdict.first is not None
    first = verdict.first
    assert (first.at, first.what, first.recorded) == (changed.at, "value", "another")
    assert was != "another"


def test_what_entered_at_a_port_that_is_not_there_is_a_difference(path: Path) -> None:
    sections = [decode(each) for each in every_section(path)]
    step = next(each for each in sections if each.kind is Kind.STEP)
    step.entered = [("nowhere", 1.0)]
    rewrite(path, [msgspec.msgpack.encode(each) for each in sections])
    verdict = replayed(path)
    assert verdict.differences == 1
    assert verdict.first == Difference(step.at, "value", "", "nowhere", 1.0, NOTHING)


def test_chunks_that_are_missing_are_named(path: Path) -> None:
    chunks = recording_in(in_chunks(path, 1)).chunks
    odd = [each for each in chunks if each.number % 2 == 1 and each.number < 12]
    assert recording_in(file_of([chunks[0], *chunks[2:]])).faults() == ["chunk 2 is missing"]
    assert recording_in(file_of([chunks[0], *chunks[3:]])).faults() == ["chunks 2 to 3 are missing"]
    clause = damage(recording_in(file_of(odd)))
    assert "chunk 2 is missing; chunk 4 is missing; chunk 6 is missing; 2 more" in clause
    assert " more" not in damage(recording_in(file_of(odd[:4])))
