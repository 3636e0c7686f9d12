"""`firmware-runtime replay RUN` for a recording of the black box: the whole run, run again."""

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from time import monotonic_ns, sleep

from firmware_runtime.cli.own_terminal import OwnTerminal
from firmware_runtime.devs.time import SECOND
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from firmware_runtime.recording.blackbox.section import Section
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.random_state import UNKEPT
from firmware_runtime.recording.recorded_board import versions_said
from firmware_runtime.recording.replay.difference import Difference, in_lines
from firmware_runtime.recording.replay.verdict import NOTHING_AGAIN, Stretch, Verdict, replay
from firmware_runtime.statistics.number_formats import NO_DATES, Dates
from firmware_runtime.system.resources import Closing


def replay_run(arguments: argparse.Namespace, path: Path) -> int:
    """Run it again, and print whether it was the same."""
    recording = read_recording(path)
    header = recording.header
    board = board_of(header)
    stretch = Stretch(arguments.begin, arguments.until)
    begun = monotonic_ns()
    with Shown(wanted=not arguments.json) as shown:
        verdict = replay(recording, board, stretch, before=paced(arguments.speed, shown))
    spent = monotonic_ns() - begun
    if arguments.json:
        print(json.dumps(_as_json(recording, verdict, spent), allow_nan=False))
    else:
        print("\n".join(_as_text(recording, verdict, spent)))
    return verdict.status


def paced(speed: float | None, shown: "Shown") -> Callable[[Section], None]:
    """What is called before each section: waits for its instant, if a speed was asked for."""
    first: list[tuple[int, int]] = []

    def before(section: Section) -> None:
        if section.has_instant:
            shown.at(section.at)
            if speed is not None:
                if not first:
                    first.append((section.at, monotonic_ns()))
                begun_at, begun = first[0]
                due = begun + round((section.at - begun_at) / speed)
                sleep(max(0, due - monotonic_ns()) / SECOND)

    return before


class Shown(Closing):
    """How far it is, on one line of a terminal if there is one."""

    def __init__(self, *, wanted: bool) -> None:
        self._terminal = OwnTerminal.of(sys.stderr) if wanted else None
        self._due = monotonic_ns() + SECOND // 2

    def at(self, at: int) -> None:
        """It has come to an instant of the run."""
        if self._terminal is not None and monotonic_ns() >= self._due:
            self._due = monotonic_ns() + SECOND // 4
            self._terminal.show(f"{at / SECOND:.1f} s")

    def close(self) -> None:
        """Leave no trace of it."""
        if self._terminal is not None:
            self._terminal.close()


def _as_json(recording: Recording, verdict: Verdict, spent: int) -> dict[str, object]:
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


def _as_text(recording: Recording, verdict: Verdict, spent: int) -> Iterator[str]:
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
