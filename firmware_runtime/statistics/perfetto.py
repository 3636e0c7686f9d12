"""What the flight recorder kept, as a trace that Perfetto and chrome://tracing open.

The board is a process, its loop a thread: a slice for each step, in it one for each function of a
model that ran. Threads of their own show the waiting for a late waking and the collections of
garbage; counters follow lateness and step time.

Slices are pairs of events, begin and end (B, E), written in the order in which they nest. The
format counts in microseconds with a fraction; a viewer that cuts the fraction off may move an
instant, but it cannot make a function outlast its step, as it could with lengths (X).

Source: Trace Event Format (Chromium project), object format.
"""

from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

from msgspec import to_builtins

from firmware_runtime.devs.time import MICROSECOND
from firmware_runtime.statistics.blame import sentence
from firmware_runtime.statistics.figures import WorstActivation
from firmware_runtime.statistics.late_watch import Late
from firmware_runtime.statistics.spans import TRACKS, Recorded
from firmware_runtime.statistics.statistics import Statistics

Event: TypeAlias = dict[str, Any]

_PROCESS = 1
_LOOP, _WAKING, _GARBAGE = 1, 2, 3
_THREADS = {_LOOP: "loop", _WAKING: "waking", _GARBAGE: "garbage"}


def chrome_trace(
    recorded: Sequence[Recorded], statistics: Statistics, trigger: Late | None = None
) -> dict[str, Any]:
    """The trace, ready for JSON; `recorded` is what `read_spans` returns, or the last part of it.

    `trigger`, the late activation it was taken for, is marked across all tracks.
    """
    figures = statistics.figures()
    conditions = figures.conditions
    board = conditions.text("board") or "firmware-runtime"
    events = [
        *_names(board),
        *_loop(recorded),
        *_waking(recorded),
        *_garbage(recorded),
        *_counters(recorded),
        *_causes(figures.worst, recorded),
        *_trigger(trigger),
    ]
    about = {"writer": to_builtins(statistics.header.writer), "conditions": conditions.as_json()}
    return {"displayTimeUnit": "ns", "otherData": about, "traceEvents": events}


def the_last(recorded: Sequence[Recorded], span_ns: int) -> list[Recorded]:
    """Of what was recorded, the entries that ended at most so long before the last of all."""
    since = max((each.end_ns for each in recorded), default=0) - span_ns
    return [each for each in recorded if each.end_ns >= since]


def _names(board: str) -> Iterator[Event]:
    yield _event("M", "process_name", _LOOP, 0, name=board)
    for thread, name in _THREADS.items():
        yield _event("M", "thread_name", thread, 0, name=name)
        yield _event("M", "thread_sort_index", thread, 0, sort_index=thread)


def _loop(recorded: Sequence[Recorded]) -> Iterator[Event]:
    """Steps with the functions in them, which were recorded before them.

    Functions without a step are those of the step under way.
    """
    functions: list[Recorded] = []
    for each in recorded:
        if each.track == "step":
            yield _event("B", "step", _LOOP, each.begin_ns)
            yield from _functions(functions)
            yield _event("E", "step", _LOOP, each.end_ns)
            functions.clear()
        elif each.track not in TRACKS:
            functions.append(each)
    yield from _functions(functions)


def _functions(functions: Sequence[Recorded]) -> Iterator[Event]:
    for each in functions:
        yield from _slice(each.track, _LOOP, each.begin_ns, each.end_ns)


def _waking(recorded: Sequence[Recorded]) -> Iterator[Event]:
    """The waiting beyond a step's instant, as far as the steps before did not fill it."""
    free_from = 0
    for each in recorded:
        if each.track == "step":
            free_from = each.end_ns
        elif each.track == "waking" and each.end_ns > free_from:
            begin = max(each.begin_ns, free_from)
            late, behind = _us(each.end_ns - each.begin_ns), _us(begin - each.begin_ns)
            yield from _slice("waking", _WAKING, begin, each.end_ns, late_us=late, behind_us=behind)


def _garbage(recorded: Sequence[Recorded]) -> Iterator[Event]:
    for each in recorded:
        if each.track == "garbage":
            yield from _slice("garbage", _GARBAGE, each.begin_ns, each.end_ns)


def _counters(recorded: Sequence[Recorded]) -> Iterator[Event]:
    """Of every step, at its begin, how late it began and how long it took."""
    late = 0
    for each in recorded:
        if each.track == "waking":
            late = each.end_ns - each.begin_ns
        elif each.track == "step":
            took = each.end_ns - each.begin_ns
            yield _event("C", "lateness (us)", _LOOP, each.begin_ns, us=_us(late))
            yield _event("C", "step (us)", _LOOP, each.begin_ns, us=_us(took))
            late = 0


def _causes(worst: Sequence[WorstActivation], recorded: Sequence[Recorded]) -> Iterator[Event]:
    """Why the worst activations of that time were late, where they began."""
    since = min((each.begin_ns for each in recorded), default=0)
    for each in sorted(worst, key=_began):
        if each.blame is not None and each.t_ns >= since:
            late = f"{each.model}: {sentence(each.blame)}"
            yield _event("i", late, _WAKING, _began(each), **each.blame.evidence) | {"s": "t"}


def _began(activation: WorstActivation) -> int:
    return activation.t_ns + round(activation.lateness_us * MICROSECOND)


def _trigger(trigger: Late | None) -> Iterator[Event]:
    if trigger is not None:
        began = trigger.t_ns + trigger.lateness_ns
        yield _event("i", str(trigger), _LOOP, began) | {"s": "g"}


def _slice(name: str, thread: int, begin: int, end: int, /, **arguments: object) -> Iterator[Event]:
    yield _event("B", name, thread, begin, **arguments)
    yield _event("E", name, thread, end)


def _event(phase: str, name: str, thread: int, at: int, /, **arguments: object) -> Event:
    event = {"ph": phase, "name": name, "pid": _PROCESS, "tid": thread, "ts": _us(at)}
    return event | {"args": arguments} if arguments else event


def _us(ns: int) -> int | float:
    """Microseconds as the format has them: whole where they are."""
    return ns // MICROSECOND if ns % MICROSECOND == 0 else ns / MICROSECOND
