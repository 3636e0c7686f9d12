"""The one result of a stage, as JSON: both ends, what was between them, and how it ended.

    {"board": ..., "stage": ..., "ended": {...}, "controller": {...}, "robot": {...},
     "link": {...}, "result": {...}}

`controller` and `robot` have `ended`, `statistics` and `outputs_on` of their runs; in a stage of
one process `robot` names that process instead. `link` is null there.
"""

import heapq
import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, TextIO

from firmware_runtime.board.roles import Stage
from firmware_runtime.errors import TraceFileError

_OF_AN_END: Final = (
    *("status", "ended", "result", "outputs_on", "recording", "statistics", "link"),
)


def of_one_process(stage: Stage, run: Mapping[str, object]) -> dict[str, Any]:
    """The document of a stage whose controller and robot are one run."""
    end = {key: run[key] for key in _OF_AN_END if key in run}
    robot = {key: each for key, each in end.items() if key != "statistics"}
    return {
        "board": run["board"],
        "stage": stage.value,
        "clock": run["clock"],
        "ended": run["ended"],
        "controller": end,
        "robot": {"process": "the controller's", **robot},
        "link": None,
        "result": run["result"],
        **({"outputs_on": run["outputs_on"]} if "outputs_on" in run else {}),
        "statistics": run["statistics"],
    }


def of_an_end(run: Mapping[str, object], status: int | None) -> dict[str, object]:
    """Return the part of one end of two; only its status where it left no more."""
    return {"status": status, **{key: run[key] for key in _OF_AN_END if key in run}}


def of_two_ends(
    controller: Mapping[str, object], robot: Mapping[str, object] | None, began: Mapping[str, int]
) -> dict[str, Any]:
    """Both ends, and their statistics merged by time of origin; `began` are their clocks' zeros.

    The robot end is None where another machine has it.
    """
    ends = {"controller": controller, **({} if robot is None else {"robot": robot})}
    result = controller.get("result") if robot is None else robot.get("result")
    found = {
        "controller": controller,
        "robot": robot,
        "result": result,
        "statistics": merged_statistics(ends, began),
    }
    if robot is not None and "outputs_on" in robot:
        found["outputs_on"] = robot["outputs_on"]
    return found


_COUNTED_BY_SENDER: Final = ("sent", "repeated", "given_up", "unconnected")
_COUNTED_BY_TAKER: Final = (
    "received",
    "dropped",
    "overtaken",
    "refused",
    "age_us",
    "round_trip_us",
)
_ADDED: Final = ("scheduled", "run", "skipped", "coalesced", "overruns")


def merged_statistics(
    ends: Mapping[str, Mapping[str, Any]], began: Mapping[str, int]
) -> dict[str, Any]:
    """Counts of all ends added up, and their worst activations on one time scale, in order.

    That scale begins where the first end did; an end that left no statistics adds nothing.
    """
    kept = {role: each["statistics"] for role, each in ends.items() if "statistics" in each}
    zero = min(began.values(), default=0)
    offsets = {role: began.get(role, zero) - zero for role in kept}
    worst = [
        {"end": role, **activation, "t_ns": activation["t_ns"] + offsets[role]}
        for role, each in kept.items()
        for activation in each.get("worst", ())
    ]
    return {
        **{name: sum(each[name] for each in kept.values()) for name in _ADDED},
        "begins_ns": offsets,
        "worst": sorted(worst, key=lambda each: each["t_ns"]),
    }


def crossed(
    controller: Mapping[str, object] | None, robot: Mapping[str, object] | None
) -> dict[str, dict[str, object]]:
    """Count both ways: sent by one end, received by the other, its age there since its origin.

    What only an end knows that left no statistics is left out.
    """
    ways = {"out": (controller, robot), "back": (robot, controller)}
    return {
        way: _one_way(_link_of(sender), _link_of(taker)) for way, (sender, taker) in ways.items()
    }


def _one_way(sender: Mapping[str, object], taker: Mapping[str, object]) -> dict[str, object]:
    sent = {name: sender[name] for name in _COUNTED_BY_SENDER if name in sender}
    return {**sent, **{name: taker[name] for name in _COUNTED_BY_TAKER if name in taker}}


def _link_of(end: Mapping[str, Any] | None) -> Mapping[str, object]:
    statistics: Mapping[str, Any] = {} if end is None else end.get("statistics", {})
    return statistics.get("link") or {}


def merge_traces(traces: Mapping[str, Path], began: Mapping[str, int], into: Path) -> None:
    """Write one file of several, each of which is in order. Raises TraceFileError."""
    zero = min(began.values(), default=0)
    lines = [
        _lines(role, path, began.get(role, zero) - zero)
        for role, path in traces.items()
        if path.exists()
    ]
    with _written(into) as file:
        for line in heapq.merge(*lines, key=lambda each: each["t_ns"]):
            file.write(f"{json.dumps(line)}\n")


def begin_trace(into: Path) -> None:
    """Make the file empty before anything runs. Raises TraceFileError."""
    with _written(into):
        pass


@contextmanager
def _written(path: Path) -> Iterator[TextIO]:
    """A file to write; raises TraceFileError where it cannot be."""
    try:
        with path.open("w") as file:
            yield file
    except OSError as error:
        fault = f"{path}: the trace cannot be written ({error.strerror})"
        raise TraceFileError(fault, expected="a file that can be made") from error


def _lines(role: str, path: Path, offset: int) -> Iterator[dict[str, Any]]:
    """An end's lines; the last one of a run that was killed may be cut off, and is left out."""
    with path.open() as file:
        for line in file:
            if line.endswith("\n"):
                found = json.loads(line)
                yield {"t_ns": found.pop("t_ns") + offset, "end": role, **found}
