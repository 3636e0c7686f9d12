"""The steps that are timed are the real ones, and the report says what was measured."""

import json
import tracemalloc
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path
from time import monotonic_ns
from typing import Any

import pytest

from benchmarks.accounting import bench as accounting
from benchmarks.accounting import cold as accounting_cold
from benchmarks.accounting import cost as accounting_cost
from benchmarks.accounting import memory as accounting_memory
from benchmarks.accounting.growth import growth, measure
from benchmarks.accounting.models import PERIOD, HastyClock, configuration, tickers
from benchmarks.accounting.start import first_step_ended
from benchmarks.accounting.steps import WAYS, AccountedStep, StopwatchClock
from benchmarks.shared.process import LoopError, seconds_of_python, status_of_python
from firmware_runtime.blackbox.chunk_file import Numbered, file_of
from firmware_runtime.blackbox.found import recording_beside
from firmware_runtime.blackbox.reader import read_recording
from firmware_runtime.board.in_force import board_in_force
from firmware_runtime.cli.main import main
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.executive import Executive
from firmware_runtime.runs.start import start_session
from firmware_runtime.statistics.layout import STEPS
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics


@pytest.mark.parametrize("count", [1, 4])
def test_a_step_put_together_is_accounted_like_one_of_the_executive(
    tmp_path: Path, count: int
) -> None:
    step = AccountedStep(count, tmp_path)
    for _ in range(20):
        step()
    put_together = read_statistics(tmp_path / "tickers.stats").as_json()
    run = Executive(tickers(count), HastyClock(), list, configuration(tmp_path))
    run.run(20 * PERIOD)
    executive = read_statistics(tmp_path / "tickers.stats").as_json()
    assert put_together["run"] == 20 * count
    assert put_together["conditions"]["run"]["steps"] == 20
    # a machine that stalls for a period skips one
    assert executive["run"] + executive["skipped"] == 20 * count
    for each in (put_together, executive):
        assert each["scheduled"] == each["run"] + each["skipped"] + each["coalesced"]


def test_the_stopwatch_counts_the_steps_after_those_left_out() -> None:
    clock = StopwatchClock(leave_out=3, passes=7)
    executive = Executive(tickers(1), clock, list)
    clock.when_done = partial(executive.request_stop, "measured")
    begun = monotonic_ns()
    executive.run()
    assert clock.passes == 7
    assert executive.statistics.cells[STEPS] == 3 + 7
    assert 0 < clock.spent < monotonic_ns() - begun


def test_a_hasty_wait_is_over_at_its_deadline() -> None:
    clock = HastyClock()
    assert clock.wait(7 * PERIOD, ()) == []
    assert clock.now() >= 7 * PERIOD


def test_what_accounting_adds_is_the_median_of_the_rounds_differences() -> None:
    rounds = [
        {"bare": 1.0, "accounted": 5.0, "loop": 9.0},
        {"bare": 2.0, "accounted": 6.0, "loop": 9.0},
        {"bare": 2.0, "accounted": 20.0, "loop": 9.0},
    ]
    found = accounting_cost.summary(2, rounds)
    assert found["accounting_us"] == 2.0
    assert (found["us"]["accounted"], found["least_us"]["accounted"]) == (6.0, 5.0)
    assert found["ratio"] == 5.0


def test_the_cost_of_a_step_and_of_an_activation_are_a_line() -> None:
    few, many = {"models": 1, "accounting_us": 5.0}, {"models": 16, "accounting_us": 35 / 16}
    assert accounting_cost.step_and_activation(few, many) == {"step_us": 3.0, "activation_us": 2.0}


def test_cold_laps_leave_out_the_first_ones() -> None:
    clock = accounting_cold.LapClock(steps=3)
    clock.laps = [10**9] * accounting_cold.WARM_UP + [1000, 3000, 2000]
    assert clock.median_us() == 2.0
    found = accounting_cold.summary(4, [(10.0, 30.0), (20.0, 30.0), (10.0, 40.0)])
    assert (found["bare_us"], found["loop_us"], found["added_us"]) == (10.0, 30.0, 20.0)


@pytest.mark.slow
@pytest.mark.real_time
def test_a_machine_that_stood_still_has_its_laps_measured_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def late(clock: MonotonicClock, at: int) -> None:
        MonotonicClock.start(clock, at + 50 * PERIOD)

    monkeypatch.setattr(accounting_cold.LapClock, "start", late)
    assert accounting_cold.bare(1, 2) > 0


# Growth -------------------------------------------------------------------------------------------


def test_what_stays_is_found_by_line() -> None:
    tracemalloc.start()
    before = tracemalloc.take_snapshot()
    kept = [object() for _ in range(1000)]
    found = growth(before, tracemalloc.take_snapshot())
    tracemalloc.stop()
    assert found["bytes"] >= 1000 * object().__sizeof__()
    assert found["objects"] >= len(kept)
    assert any(Path(__file__).name in place for place in found["places"])


@pytest.mark.slow
def test_ticks_leave_nothing_behind(tmp_path: Path) -> None:
    found = measure(tmp_path, 8_000)  # it keeps a reading of the counters of some 2 kB now and then
    assert found["ratio"] == found["bytes"] / 8_000
    assert found["ratio"] < 1, found["places"]


# Start and memory ---------------------------------------------------------------------------------


def run_of_a_robot(path: Path) -> Statistics:
    board = board_in_force("tachobot", ("executive.fifo_priority=0", "recording.minutes=0.1"))
    recording = recording_beside(path)
    session = start_session(
        board, MonotonicClock(), doubles=True, statistics_path=path, recording=recording
    )
    with closing(session):
        session.run(20 * MILLISECOND)
    return read_statistics(path)


@pytest.mark.slow
@pytest.mark.real_time
def test_the_first_step_is_found_on_the_clock_of_the_machine(tmp_path: Path) -> None:
    path = tmp_path / "robot.stats"
    begun = monotonic_ns()
    statistics = run_of_a_robot(path)
    assert begun < first_step_ended(statistics, recording_beside(path)) < monotonic_ns()


@pytest.mark.slow
@pytest.mark.real_time
def test_a_first_step_that_was_written_over_is_not_made_up(tmp_path: Path) -> None:
    path = tmp_path / "robot.stats"
    statistics = run_of_a_robot(path)
    first, *_ = read_recording(recording_beside(path)).chunks
    (tmp_path / "later").write_bytes(file_of([Numbered(2, first.contents)]))
    with pytest.raises(LoopError, match="first step is no longer recorded"):
        first_step_ended(statistics, tmp_path / "later")


@pytest.mark.slow
def test_a_bare_interpreter_has_a_size_and_a_start(tmp_path: Path) -> None:
    assert seconds_of_python(tmp_path, "pass") > 0
    assert status_of_python(tmp_path, "pass", "Threads") == 1
    with pytest.raises(LoopError, match="has no VmNothing"):
        status_of_python(tmp_path, "pass", "VmNothing")


def test_memory_is_shown_in_megabytes_by_that_of_numpy() -> None:
    assert accounting_memory.megabytes(1_000_000) == 1024.0
    megabytes = {"python": 10.0, "python with numpy": 20.0, "without doubles": 30.0}
    lines = accounting_memory.text({"megabytes": megabytes, "goal_mb": 45.0, "ratio": 1.5})
    assert lines[3].split() == ["without", "doubles", "30.0"]
    assert lines[-1].startswith("ratio 1.50")


# The command --------------------------------------------------------------------------------------

QUICK = ("--repetitions", "1", "--activations", "64", "--ticks", "50", "--cold-steps", "2")


@pytest.mark.slow
def test_the_ratio_comes_last(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "accounting", "--only", "growth", "--only", "cold", *QUICK]) == 0
    printed = capsys.readouterr()
    assert printed.out.splitlines()[-1].startswith("ratio ")
    assert printed.err.splitlines() == ["bench accounting: growth", "bench accounting: cold"]


@pytest.mark.slow
def test_the_report_is_kept_as_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["bench", "accounting", "--only", "cost", *QUICK, "--json", "--save", str(tmp_path)]
    assert main(arguments) == 0
    report = json.loads(capsys.readouterr().out)
    assert json.loads((tmp_path / "accounting.json").read_text()) == report
    assert list(report) == ["conditions", "cost", "ratio"]
    assert report["ratio"] == report["cost"]["ratio"]
    (one, _, _) = report["cost"]["steps_of"]
    assert list(one["us"]) == list(WAYS)


@pytest.mark.slow
def test_processes_are_started_and_weighed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(accounting_memory, "STEADY_NS", 1)
    parts = ("--only", "start", "--only", "memory", "--json")
    assert main(["bench", "accounting", *parts, "--repetitions", "1"]) == 0
    report = json.loads(capsys.readouterr().out)
    seconds, sizes = report["start"]["seconds"], report["memory"]["megabytes"]
    assert min(seconds.values()) > 0
    assert report["start"]["ratio"] == seconds["as shipped"] / seconds["python"]
    assert sizes["without doubles"] > sizes["python"] > 0
    assert sizes["without doubles, locked"] > sizes["python"]
    assert report["ratio"] == report["memory"]["ratio"]


def test_another_part_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_:
        main(["bench", "accounting", "--only", "speed"])
    assert exit_.value.code == 2
    assert "invalid choice: 'speed'" in capsys.readouterr().err


def test_every_part_is_measured_and_printed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    measured: list[str] = []

    def fake(part: str, *_arguments: object) -> dict[str, Any]:
        measured.append(part)
        return {"ratio": float(len(measured))}

    reported: dict[str, Callable[[dict[str, Any]], list[str]]] = {
        part: lambda result: [f"ratio {result['ratio']}"] for part in accounting.TEXTS
    }
    monkeypatch.setattr(accounting, "_measure", fake)
    monkeypatch.setattr(accounting, "TEXTS", reported)
    assert main(["bench", "accounting"]) == 0
    assert measured == ["start", "memory", "growth", "cold", "cost"]
    assert capsys.readouterr().out.splitlines()[-1] == "ratio 5.0"
