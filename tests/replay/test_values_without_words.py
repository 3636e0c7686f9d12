"""What a model sends that a recording has no words for: said to be so, and nothing else suffers."""

import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.recording.blackbox.section import (
    Section,
    count_of_unknown,
    decode,
    encode,
    encode_in_words,
    sent_in,
    sent_of,
)
from firmware_runtime.recording.exports.typed_values import values_in
from firmware_runtime.recording.replay.difference import Difference
from tests.support.allocation import sends
from tests.support.command import Command
from tests.support.recorded import record

HUGE = 1 << 70


def section_of(*values: object) -> Section:
    sent = [each for pair in enumerate(values) for each in pair]
    return decode(encode_in_words((4, 0, [], [], [], [], sent, [], [], None)))


def test_a_value_that_cannot_be_written_takes_no_other_with_it() -> None:
    section = section_of(1.5, HUGE, [HUGE, Fraction(1, 3)], b"\x01", Fraction(1, 3))
    assert [form for _, form in sent_of(section)] == [
        1.5,
        {"int": [str(HUGE)]},
        {"unknown": "builtins:list"},
        b"\x01",
        {"unknown": "fractions:Fraction"},
    ]
    assert [each.value for each in values_in(section, list("abcde"), {})][:2] == [1.5, HUGE]


@pytest.mark.parametrize("sent", [[0, 1.5, 2], [0, 1.5, "imu", 2.5], [None, 1.5]])
def test_values_that_are_none_of_a_port_are_refused(sent: list[object]) -> None:
    content = encode((4, 0, [], [], [], [], sent, [], [], None))
    with pytest.raises(ConfigError, match="expected ports and values in turns"):
        sent_of(decode(content))
    with pytest.raises(ConfigError, match="expected ports and values in turns"):
        sent_in(content)


@pytest.mark.parametrize(
    ("value", "count"),
    [
        (Fraction(1, 3), 1),
        ([1, {"a": (2.5, Fraction(1, 3))}], 1),
        ("unknown", 0),
        ({"unknown": 3}, 0),
        ({"a": "unknown"}, 0),
    ],
)
def test_values_known_by_a_class_alone_are_counted(value: object, count: int) -> None:
    assert count_of_unknown(section_of(value, 1.5)) == count


def test_numbers_of_numpy_are_shown_as_numbers() -> None:
    recorded, replayed = (sent_of(section_of(each))[0][1] for each in (np.float64(0.1), np.eye(2)))
    said = Difference(0, "value", "model", "port", recorded, replayed).as_json()
    assert (said["recorded"], said["replayed"]) == (0.1, [[1.0, 0.0], [0.0, 1.0]])


class Level(float):
    """A number of a class that a recording has no word for."""


@pytest.mark.slow
def test_a_replay_says_how_many_values_it_could_not_compare_as_a_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    path = record(tmp_path / "plain.recording", "tachobot", 1.0)
    assert command.document("replay", path)["unknown"] == 0
    sends(monkeypatch, lambda _, force: Level(force))
    path = record(tmp_path / "level.recording", "tachobot", 1.0)
    ended = command("replay", path, "--json")
    said = json.loads(ended.out)
    assert ended.status == Status.NOT_ALL_COMPARED
    assert said["identical"] is None
    assert said["unknown"] == said["values"] - said["compared"] > 10
    assert f"{said['unknown']} values of controller.allocation" in command("replay", path).out
