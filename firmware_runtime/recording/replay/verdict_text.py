"""What a replay found, for people and as a document."""

from collections.abc import Iterator

from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.blackbox.reader import Recording
from firmware_runtime.recording.blackbox.state_of_run import UNKEPT
from firmware_runtime.recording.recorded_board import versions_said
from firmware_runtime.recording.replay.difference import Difference, in_lines
from firmware_runtime.recording.replay.verdict import NOTHING_AGAIN, Verdict
from firmware_runtime.statistics.number_formats import NO_DATES, Dates


def verdict_document(recording: Recording, verdict: Verdict, spent: int) -> dict[str, object]:
    """Return the verdict with the run that it is of, for JSON."""
    header = recording.header
    return {
        **verdict.as_json(recording.dates()),
        "run": header.run,
        "board": header.board,
        "role": header.role,
        "recording": str(recording.path),
        "code_sha256": header.code_sha256,
        "times_real_time": verdict.duration / max(spent, 1),
    }


def verdict_lines(recording: Recording, verdict: Verdict, spent: int) -> Iterator[str]:
    """Yield whether it was the same, the first difference, and what belongs to the verdict."""
    header = recording.header
    for fault in verdict.faults:
        yield f"not whole: {fault}"
    if verdict.first is not None:
        yield f"{verdict.differences} differences; the first:"
        yield from difference_in_words(verdict.first, recording.dates())
        if verdict.has_drawn:
            yield f"  {UNKEPT}"
    elif verdict.is_something and (verdict.not_compared or not verdict.faults):
        yield f"{verdict.in_words}, {verdict.writes} transfers of {header.run}"
    elif not verdict.is_something:
        yield NOTHING_AGAIN
    yield from (f"  not compared: {each}" for each in verdict.not_compared)
    duration, times = verdict.duration / SECOND, verdict.duration / max(spent, 1)
    digits = 0 if times >= 10 else 1
    speed = f"{times:.{digits}f} times real time"
    span = f"{duration:.3f} s of the run"
    yield f"  {verdict.steps} steps, {span}{recording.dates().said(0)}, {speed}"
    yield from _notes(verdict)


def _notes(verdict: Verdict) -> Iterator[str]:
    """What belongs to the verdict, a line each."""
    if verdict.began_earlier is not None:
        yield f"  {verdict.began_earlier}"
    if verdict.played_back:
        yield f"  {verdict.played_back} values of its world were played back"
    if verdict.failure is not None and verdict.differences == 0:
        yield f"  it ended so again: {verdict.failure}"
    elif verdict.end is not None:
        yield f"  the run had failed: {verdict.end}"
    if verdict.code_changed:
        yield f"  code that has changed since: {', '.join(verdict.code_changed)}"
    if verdict.versions_changed:
        said = versions_said(verdict.versions_changed)
        yield f"  versions that are others than in the run: {said}"


def difference_in_words(difference: Difference, dates: Dates = NO_DATES) -> Iterator[str]:
    """When, where, and both values."""
    yield from (f"  {line}" for line in in_lines(difference.as_json(dates)))
