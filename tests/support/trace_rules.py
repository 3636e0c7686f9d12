"""The rules of the Trace Event Format that a viewer relies on, as far as our traces use it."""

import json
from collections import defaultdict
from typing import Any

_PHASES = {"M", "B", "E", "C", "i"}
_METADATA = {"process_name", "thread_name", "thread_sort_index"}


def assert_sound(trace: dict[str, Any]) -> None:
    """Every event has what its phase demands, and slices of a thread nest in order of time."""
    assert json.loads(json.dumps(trace, allow_nan=False)) == trace
    assert trace["displayTimeUnit"] in {"ms", "ns"}
    assert isinstance(trace["otherData"], dict)
    for event in trace["traceEvents"]:
        _assert_event(event)
    _assert_nesting(trace["traceEvents"])


def slices(trace: dict[str, Any], thread: str) -> list[tuple[int, str, float, float]]:
    """The slices of a thread in order of their beginning: depth, name, begin, end, in us."""
    found: list[tuple[int, str, float, float]] = []
    opened: list[tuple[int, int, dict[str, Any]]] = []
    for event in _of_thread(trace, thread):
        if event["ph"] == "B":
            opened.append((len(opened), len(found), event))
            found.append((0, "", 0.0, 0.0))
        elif event["ph"] == "E":
            depth, place, begun = opened.pop()
            found[place] = depth, begun["name"], begun["ts"], event["ts"]
    return found


def counter(trace: dict[str, Any], name: str) -> list[tuple[float, float]]:
    """Instants and values of a counter, in us."""
    events = [each for each in trace["traceEvents"] if each["ph"] == "C" and each["name"] == name]
    return [(each["ts"], each["args"]["us"]) for each in events]


def _of_thread(trace: dict[str, Any], thread: str) -> list[dict[str, Any]]:
    named = {
        event["args"]["name"]: event["tid"]
        for event in trace["traceEvents"]
        if event["name"] == "thread_name"
    }
    return [event for event in trace["traceEvents"] if event["tid"] == named[thread]]


def _assert_event(event: dict[str, Any]) -> None:
    assert event["ph"] in _PHASES, event
    assert isinstance(event["name"], str)
    assert type(event["pid"]) is int
    assert type(event["tid"]) is int
    assert type(event["ts"]) in {int, float}
    assert event["ts"] >= 0
    if event["ph"] == "M":
        assert event["name"] in _METADATA
        assert event["args"]
    if event["ph"] == "C":
        assert all(type(value) in {int, float} for value in event["args"].values())
    if event["ph"] == "i":
        assert event["s"] in {"g", "p", "t"}


def _assert_nesting(events: list[dict[str, Any]]) -> None:
    opened: dict[int, list[str]] = defaultdict(list)
    reached: dict[int, float] = defaultdict(float)
    for event in events:
        if event["ph"] not in {"B", "E"}:
            continue
        thread = event["tid"]
        assert event["ts"] >= reached[thread], event
        reached[thread] = event["ts"]
        if event["ph"] == "B":
            opened[thread].append(event["name"])
        else:
            assert opened[thread].pop() == event["name"], event
    assert not any(opened.values())
