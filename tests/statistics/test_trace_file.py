import json
import math
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
from firmware_runtime.statistics.trace_file import TraceFile
from tests.support.devs_models import Clock, top


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
