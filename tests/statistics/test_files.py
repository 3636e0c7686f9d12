"""Files that are replaced at once, and traces."""

import json
import math
import os
import tracemalloc
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from firmware_runtime.devs.simulator import Simulator
from firmware_runtime.devs.trace import trace
from firmware_runtime.errors import TraceFileError
from firmware_runtime.statistics.json_values import plain
from firmware_runtime.statistics.paths import Companion
from firmware_runtime.statistics.takeovers import (
    Takeover,
    note_takeover,
    read_takeovers,
)
from firmware_runtime.statistics.trace_file import TraceFile
from firmware_runtime.statistics.value_table import wide_columns, within_64_bits
from firmware_runtime.system.atomic_file import (
    OWN_AND_GROUP,
    keep_file,
    read_file,
    replace_file,
)
from firmware_runtime.system.this_process import this_process
from tests.support.devs_models import Clock, top


@pytest.fixture
def open_umask() -> Iterator[None]:
    before = os.umask(0)
    yield
    os.umask(before)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tachobot.guard"


def permissions(path: Path) -> int:
    return path.stat().st_mode & 0o777


@pytest.mark.usefixtures("open_umask")
def test_the_permissions_are_those_stated_whatever_the_umask(path: Path) -> None:
    replace_file(path, b"x", OWN_AND_GROUP)
    assert permissions(path) == 0o640
    os.umask(0o777)
    replace_file(path, b"y", OWN_AND_GROUP)
    assert permissions(path) == 0o640


def test_what_lies_where_it_is_made_is_neither_followed_nor_written_to(path: Path) -> None:
    planted = path.parent / f".{path.name}.{os.getpid()}"
    victim = path.parent / "victim"
    victim.write_text("whole")
    planted.symlink_to(victim)
    replace_file(path, b"x")
    assert (victim.read_text(), path.read_bytes()) == ("whole", b"x")
    assert not path.is_symlink()


def test_what_could_not_be_finished_is_removed(path: Path) -> None:
    path.mkdir()
    with pytest.raises(OSError, match="directory"):
        replace_file(path, b"x")
    assert [each.name for each in path.parent.iterdir()] == [path.name]


def test_a_fifo_is_not_waited_for(path: Path) -> None:
    os.mkfifo(path)
    with pytest.raises(OSError, match="no regular file"):
        read_file(path)


@pytest.mark.usefixtures("open_umask")
def test_a_place_that_a_user_named_is_replaced_only_if_it_is_a_file(path: Path) -> None:
    keep_file(path, b"one")
    keep_file(path, b"two")
    assert path.read_bytes() == b"two"
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(OSError, match="no regular file"):
        keep_file(path, b"three")
    assert path.is_fifo()


def test_a_link_that_a_user_named_stays_a_link(path: Path) -> None:
    path.symlink_to(path.with_name("target"))
    keep_file(path, b"one")
    assert path.is_symlink()
    assert path.with_name("target").read_bytes() == b"one"


def test_what_a_guard_notes_is_for_its_group_and_not_for_all_users(tmp_path: Path) -> None:
    statistics = tmp_path / "tachobot.stats"
    note_takeover(statistics, Takeover(1, this_process(), 1, "it hung"))
    assert permissions(Companion.TAKEOVERS.beside(statistics)) == 0o640


@pytest.mark.parametrize("content", [b"\xff\xfe\n", b"[" * 100_000, b'{"at_ns": 1e999}\n', b"\0"])
def test_no_content_keeps_a_guard_from_starting(path: Path, content: bytes) -> None:
    path.write_bytes(content)
    assert read_takeovers(path.with_suffix(".stats")) == []


def test_a_fifo_in_its_place_keeps_a_guard_from_nothing(path: Path) -> None:
    os.mkfifo(path)
    assert read_takeovers(path.with_suffix(".stats")) == []


def test_a_small_file_takes_little_memory(tmp_path: Path) -> None:
    path = tmp_path / "board.toml"
    path.write_bytes(b"kept")
    tracemalloc.start()
    try:
        assert read_file(path) == b"kept"
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


class Motion(NamedTuple):
    position: float
    rate: float


@dataclass(frozen=True, slots=True)
class Report:
    motion: Motion
    text: str


class Stage(Enum):
    ARMED = 2


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (1, 1),
        (1.5, 1.5),
        ("off", "off"),
        (True, True),
        (None, None),
        (math.nan, "nan"),
        (math.inf, "inf"),
        (-math.inf, "-inf"),
        ((1, [2.0, math.nan]), [1, [2.0, "nan"]]),
        (Motion(1.0, -math.inf), {"position": 1.0, "rate": "-inf"}),
        (Report(Motion(0.5, 0), "ok"), {"motion": {"position": 0.5, "rate": 0}, "text": "ok"}),
        ({1: (2, 3)}, {"1": [2, 3]}),
        (Stage.ARMED, "ARMED"),
        (np.float64(1.5), 1.5),
        (np.float64(math.nan), "nan"),
        (np.int64(3), 3),
        (np.array([[1.0, math.inf]]), [[1.0, "inf"]]),
        (1 << 62, 1 << 62),
        (b"\x01", "b'\\x01'"),
    ],
)
def test_values_become_what_json_can_say(value: object, expected: object, tmp_path: Path) -> None:
    with TraceFile(tmp_path / "trace") as file:
        file.write(5, "a.b", value)
    written = json.loads((tmp_path / "trace").read_text(), parse_constant=pytest.fail)
    assert written == {"t_ns": 5, "port": "a.b", "value": expected}
    assert type(written["value"]) is type(expected)


def test_a_table_has_a_column_for_each_field_and_one_for_a_value_that_has_none() -> None:
    passed = [Report(Motion(0.5, -math.inf), "ok"), 3, None, Motion(1.0, math.inf), Stage.ARMED]
    assert wide_columns(passed) == {
        "motion.position": [0.5, None, None, None, None],
        "motion.rate": [-math.inf, None, None, None, None],
        "text": ["ok", None, None, None, None],
        "value": [None, "3", None, None, "ARMED"],
        "position": [None, None, None, 1.0, None],
        "rate": [None, None, None, math.inf, None],
    }
    for numbers, kind in (([1, 2], int), ([1, 2.5], float)):
        assert [type(each) for each in wide_columns(numbers)["value"]] == [kind] * 2


@pytest.mark.parametrize("beyond", [1 << 63, -(1 << 63) - 1])
def test_a_whole_number_that_has_no_room_in_64_bits_makes_its_column_one_of_texts(
    beyond: int,
) -> None:
    held = [-(1 << 63), 0, None, (1 << 63) - 1]
    assert within_64_bits(held) == held
    assert within_64_bits([7, None, beyond]) == ["7", None, str(beyond)]


def test_a_class_is_not_taken_for_one_of_its_objects() -> None:
    assert plain(Report) == str(Report)


def test_a_run_is_written_one_message_a_line(tmp_path: Path) -> None:
    simulator = Simulator(top(Clock("slow", 20), Clock("fast", 10)))
    with TraceFile(tmp_path / "trace") as file:
        trace(simulator, file.write)
        simulator.run(20)
    assert (tmp_path / "trace").read_text() == (
        '{"t_ns":10,"port":"fast.ticks","value":0}\n'
        '{"t_ns":20,"port":"slow.ticks","value":0}\n'
        '{"t_ns":20,"port":"fast.ticks","value":1}\n'
    )


def test_a_file_that_cannot_be_made_is_said_with_its_path(tmp_path: Path) -> None:
    path = tmp_path / "absent" / "trace"
    with pytest.raises(TraceFileError, match="the trace cannot be written") as refusal:
        TraceFile(path)
    assert str(refusal.value).startswith(f"{path}: ")


def test_a_full_disk_ends_the_trace_and_not_the_run() -> None:
    file = TraceFile(Path("/dev/full"))
    for at in range(10_000):
        file.write(at, "port", 1.0)
    with pytest.raises(TraceFileError, match=r"/dev/full: the trace ends early \(No space left"):
        file.__exit__(None, None, None)
