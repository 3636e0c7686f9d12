"""Trace of a recorded run that Perfetto and chrome://tracing open.

The board is a process, its loop a thread: a slice for each step, in it one for each function of a
model that ran. A thread of its own shows the waiting for a late waking; counters follow lateness
and step time.

Slices are pairs of events, begin and end (B, E), written in the order in which they nest. The
format counts in microseconds with a fraction; a viewer that cuts the fraction off may move an
instant, but it cannot make a function outlast its step, as it could with lengths (X).

Source: Trace Event Format (Chromium project), object format.
"""

from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

from msgspec import to_builtins

from firmware_runtime.devs.time import MICROSECOND
from firmware_runtime.recording.exports.observed_run import Moment
from firmware_runtime.statistics.blame import sentence
from firmware_runtime.statistics.figures import WorstActivation
from firmware_runtime.statistics.late_watch import Late
from firmware_runtime.statistics.statistics import Statistics

Event: TypeAlias = dict[str, object]

_PROCESS = 1
_LOOP, _WAKING = 1, 2
_THREADS = {_LOOP: "loop", _WAKING: "waking"}


def chrome_trace(
    board: str,
    steps: Sequence[Moment],
    statistics: Statistics | None = None,
    trigger: Late | None = None,
) -> dict[str, Any]:
    """The trace, ready for JSON.

    The run's statistics, where there are some, know why steps were late, and the conditions.
    `trigger`, the late activation it was taken for, is marked across all tracks.
    """
    about: dict[str, object] = {}
    worst: Sequence[WorstActivation] = ()
    if statistics is not None:
        figures = statistics.figures()
        worst = figures.worst
        about["writer"] = to_builtins(statistics.header.writer)
        about["conditions"] = figures.conditions.as_json()
    events = [
        *_names(board),
        *_loop(steps),
        *_waking(steps),
        *_counters(steps),
        *_causes(worst, steps),
        *_trigger(trigger),
    ]
    return {"displayTimeUnit": "ns", "otherData": about, "traceEvents": events}


def _names(board: str) -> Iterator[Event]:
    yield _event("M", "process_name", _LOOP, 0, name=board)
    for thread, name in _THREADS.items():
        yield _event("M", "thread_name", thread, 0, name=name)
        yield _event("M", "thread_sort_index", thread, 0, sort_index=thread)


def _loop(steps: Sequence[Moment]) -> Iterator[Event]:
    """Steps with the functions in them."""
    for step in steps:
        yield _event("B", "step", _LOOP, step.begin)
        for each in step.ran:
            yield from _slice(each.model, _LOOP, each.begin, each.end, function=each.function)
        yield _event("E", "step", _LOOP, step.end)


def _waking(steps: Sequence[Moment]) -> Iterator[Event]:
    """The waiting beyond a step's instant, as far as the steps before did not fill it."""
    free_from = 0
    for step in steps:
        if step.begin > step.at:
            begin = max(step.at, free_from)
            if step.begin > free_from:
                late, behind = _us(step.begin - step.at), _us(begin - step.at)
                yield from _slice(
                    "waking", _WAKING, begin, step.begin, late_us=late, behind_us=behind
                )
        free_from = step.end


def _counters(steps: Sequence[Moment]) -> Iterator[Event]:
    """Yield how late each step began and how long it took."""
    for step in steps:
        late, took = max(step.begin - step.at, 0), step.end - step.begin
        yield _event("C", "lateness (us)", _LOOP, step.begin, us=_us(late))
        yield _event("C", "step (us)", _LOOP, step.begin, us=_us(took))


def _causes(worst: Sequence[WorstActivation], steps: Sequence[Moment]) -> Iterator[Event]:
    """Yield why the worst activations of that time were late, where they began."""
    if not steps:
        return
    for each in sorted(worst, key=_began):
        if each.blame is not None and steps[0].at <= each.t_ns <= steps[-1].at:
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
