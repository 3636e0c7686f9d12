"""`perfetto`: a trace at once, or when an activation was late, and a sentence where there is none.

The run under way is a file that the test itself writes: whenever the command waits, time passes.
"""

import json
from collections.abc import Callable
from itertools import cycle
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.cli.commands import perfetto
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.statistics.errors import BeingWrittenError
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.spans import MODELS, STEP, WAKING, SpanRing
from firmware_runtime.statistics.statistics import RunState, Statistics
from tests.support.trace_rules import assert_sound, slices
from tests.support.written_run import LAYOUT, WrittenRun

Command = Callable[..., Any]


class RecordedRun(WrittenRun):
    """A run under way that keeps a record of its steps."""

    def __init__(self, path: Path) -> None:
        super().__init__(path=path)
        self._ring = SpanRing(LAYOUT.timed, 64, path.with_suffix(".spans"))

    def step(self, lateness: int) -> None:
        """Ten milliseconds later, one more activation of `imu`."""
        at = self.elapsed // (10 * MILLISECOND) * (10 * MILLISECOND) + 10 * MILLISECOND
        began = at + lateness
        self.activation(at, lateness, MILLISECOND)
        self.keep([1_000_000], t_ns=at, lateness_ns=lateness, step_ns=MILLISECOND)
        self._ring.record(MODELS, began, began + 900_000)
        self._ring.record(WAKING, at, began)
        self._ring.record(STEP, began, began + MILLISECOND)


@pytest.fixture
def run(state_directory: Path) -> RecordedRun:
    state_directory.mkdir()
    made = RecordedRun(state_directory / "robot.stats")
    made.step(9 * MILLISECOND)
    return made


@pytest.fixture
def output(tmp_path: Path) -> Path:
    return tmp_path / "trace.json"


def test_a_trace_is_taken_at_once(command: Command, run: RecordedRun, output: Path) -> None:
    run.step(0)
    ended = command("perfetto", "robot", "-o", output)
    assert (ended.status, ended.error) == (0, "")
    assert ended.out == f"{output}: 6 spans, from 0.010 s to 0.031 s\n"
    trace = json.loads(output.read_text())
    assert_sound(trace)
    assert [name for _, name, _, _ in slices(trace, "loop")] == ["step", "imu", "step", "imu"]


def test_only_the_last_seconds_are_taken(command: Command, run: RecordedRun, output: Path) -> None:
    for _ in range(10):
        run.step(0)
    assert command("perfetto", "-o", output, "--last", 0.0305).status == 0
    steps = [each for each in slices(json.loads(output.read_text()), "loop") if each[0] == 0]
    assert [begin for _, _, begin, _ in steps] == [90_000, 100_000, 110_000, 120_000]


def test_a_late_activation_takes_the_trace_with_what_came_of_it(
    command: Command, run: RecordedRun, output: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lateness = iter([0, 3 * MILLISECOND, MILLISECOND])
    monkeypatch.setattr(perfetto, "sleep", lambda _span: run.step(next(lateness)))
    ended = command("perfetto", "-o", output, "--when-late", 2000)
    assert ended.status == 0
    assert ended.out.endswith("taken because of imu at 0.040 s, 3.00 ms late\n")
    trace = json.loads(output.read_text())
    assert_sound(trace)
    assert next(lateness, None) is None
    assert slices(trace, "waking")[-1] == (0, "waking", 50_000, 51_000)
    (mark,) = [each for each in trace["traceEvents"] if each["ph"] == "i"]
    assert mark["ts"] == 43_000


def test_a_run_that_is_stopped_half_way_through_its_counting_is_read_when_it_goes_on(
    command: Command, run: RecordedRun, output: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    is_stopped = cycle([True, False])

    def read(kept: Path) -> Statistics:
        if next(is_stopped):
            raise BeingWrittenError("it keeps the file half written")
        return read_statistics(kept)

    monkeypatch.setattr(perfetto, "read_statistics", read)
    monkeypatch.setattr(perfetto, "sleep", lambda _span: run.step(3 * MILLISECOND))
    ended = command("perfetto", "-o", output, "--when-late", 2000)
    assert (ended.status, ended.error) == (0, "")
    ended = command("perfetto", "-o", output)
    assert (ended.status, "half written" in ended.error) == (2, True)


def test_waiting_has_an_end(
    command: Command, run: RecordedRun, output: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    instants = iter([0.0, 0.1, 0.2, 5.1])
    monkeypatch.setattr(perfetto, "monotonic", lambda: next(instants))
    monkeypatch.setattr(perfetto, "sleep", lambda _span: run.step(MILLISECOND))
    ended = command("perfetto", "-o", output, "--when-late", 2000, "--wait", 5)
    assert (ended.status, ended.out) == (6, "")
    assert "no activation was over 2000 us late within 5 s" in ended.error
    assert not output.exists()


def test_waiting_ends_with_the_run(
    command: Command, run: RecordedRun, output: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(perfetto, "sleep", lambda _span: run.statistics(RunState.ENDED))
    ended = command("perfetto", "-o", output, "--when-late", 2000)
    assert ended.status == 6
    assert "the run is not under way" in ended.error


def test_ctrl_c_ends_the_waiting_cleanly(
    command: Command, run: RecordedRun, output: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(_span: float) -> None:
        run.step(0)
        raise KeyboardInterrupt

    monkeypatch.setattr(perfetto, "sleep", interrupt)
    ended = command("perfetto", "-o", output, "--when-late", 2000)
    assert ended.status == 130
    assert ended.error == "firmware-runtime: interrupted; no trace was written\n"
    assert not output.exists()


@pytest.mark.parametrize("waiting", [[], ["--when-late", 2000]])
def test_a_run_without_a_recorder_is_answered_with_how_to_have_one(
    command: Command, run: RecordedRun, output: Path, state_directory: Path, waiting: list[object]
) -> None:
    (state_directory / "robot.spans").unlink()
    assert run.elapsed > 0
    ended = command("perfetto", "-o", output, *waiting)
    assert ended.status == 2
    assert "not a copy, with recorded_spans over 0 under [executive] in board.toml" in ended.error


def test_without_a_run_that_is_what_it_says(command: Command, output: Path) -> None:
    ended = command("perfetto", "nosuch", "-o", output)
    assert ended.status == 2
    assert "no statistics of nosuch" in ended.error


def test_a_limit_of_waiting_alone_is_refused(command: Command, output: Path) -> None:
    ended = command("perfetto", "-o", output, "--wait", 3)
    assert ended.status == 2
    assert "--wait belongs to --when-late" in ended.error


def test_a_file_that_cannot_be_written_is_said(
    command: Command, run: RecordedRun, tmp_path: Path
) -> None:
    assert run.elapsed > 0
    ended = command("perfetto", "-o", tmp_path / "absent" / "trace.json")
    assert ended.status == 2
    assert "cannot be written (No such file or directory)" in ended.error
