"""The one result of two ends, and their traces, by time of origin."""

import json
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.board.registry import load
from firmware_runtime.board.roles import Stage
from firmware_runtime.errors import TraceFileError
from firmware_runtime.lab.stages.document import (
    crossed,
    merge_traces,
    merged_statistics,
    of_one_process,
    of_two_ends,
)
from firmware_runtime.lab.stages.staged_run import Staged, run_staged


def statistics(run: int, *worst: int) -> dict[str, Any]:
    counts = dict.fromkeys(("scheduled", "skipped", "coalesced", "overruns"), 0)
    activations = [{"t_ns": at, "model": "imu"} for at in worst]
    return {**counts, "run": run, "worst": activations}


def test_counts_add_up_and_the_worst_are_in_order_of_time() -> None:
    ends = {
        "controller": {"statistics": statistics(3, 50, 10)},
        "robot": {"statistics": statistics(4, 30)},
    }
    merged = merged_statistics(ends, {"controller": 1_100, "robot": 1_000})
    assert merged["run"] == 7
    assert merged["begins_ns"] == {"controller": 100, "robot": 0}
    assert [(each["end"], each["t_ns"]) for each in merged["worst"]] == [
        ("robot", 30),
        ("controller", 110),
        ("controller", 150),
    ]


def test_an_end_that_left_nothing_adds_nothing() -> None:
    controller = {"status": 137}
    robot = {"status": 143, "result": {"found": True}, "statistics": statistics(4)}
    found = of_two_ends(controller, robot, {"robot": 5})
    assert found["statistics"]["run"] == 4
    assert found["result"] == {"found": True}
    assert "outputs_on" not in found


def test_without_a_robot_end_here_the_result_is_what_the_controller_knows() -> None:
    controller = {"result": {"yaw_rad": 1.0}, "statistics": statistics(1)}
    found = of_two_ends(controller, None, {})
    assert found["robot"] is None
    assert found["result"] == {"yaw_rad": 1.0}


def test_what_went_each_way_is_from_both_ends() -> None:
    taken = {"received": 9, "dropped": 1, "overtaken": 3, "refused": {"stale": 2}}
    controller = {"statistics": {"link": {"sent": 12, "repeated": 1, **taken}}}
    sent = {"sent": 11, "repeated": 0, "given_up": 1, "unconnected": 77}
    robot = {"statistics": {"link": {**sent, **taken, "received": 10}}}
    found = crossed(controller, robot)
    assert found["back"] == {**sent, **taken}
    assert found["out"] == {"sent": 12, "repeated": 1, **taken, "received": 10}
    assert crossed(controller, None)["out"] == {"sent": 12, "repeated": 1}


def test_one_process_is_both_ends() -> None:
    run = {"board": "b", "clock": "virtual", "ended": {}, "result": {}, "statistics": {"run": 1}}
    found = of_one_process(Stage.SIMULATION, run)
    assert found["controller"]["statistics"] == {"run": 1}
    assert found["robot"] == {"process": "the controller's", "ended": {}, "result": {}}
    assert found["link"] is None


def test_traces_are_merged_by_time_of_origin(tmp_path: Path) -> None:
    traces = {"controller": (5, 40), "robot": (10, 30)}
    paths = {}
    for role, instants in traces.items():
        paths[role] = tmp_path / role
        lines = (json.dumps({"t_ns": at, "port": "p", "value": None}) for at in instants)
        paths[role].write_text("".join(f"{line}\n" for line in lines) + '{"t_ns": cut of')
    merged = tmp_path / "merged"
    merge_traces(paths, {"controller": 120, "robot": 100}, merged)
    found = [json.loads(line) for line in merged.read_text().splitlines()]
    assert [(each["t_ns"], each["end"]) for each in found] == [
        (10, "robot"),
        (25, "controller"),
        (30, "robot"),
        (60, "controller"),
    ]
    with pytest.raises(TraceFileError):
        merge_traces(paths, {}, tmp_path / "no folder" / "merged")


def test_a_trace_that_cannot_be_written_is_refused_before_anything_starts(tmp_path: Path) -> None:
    trace = tmp_path / "no folder" / "trace.jsonl"
    board = load("tachobot")
    staged = Staged(board=board, named="none", stage=Stage.NETWORK, for_s=1.0, trace=trace)
    said: list[str] = []
    with pytest.raises(TraceFileError):
        run_staged(staged, said.append, lambda _: None)
    assert said == []
