"""Whether an activation ever waits for a keyframe: `firmware-runtime bench keyframes`.

TachoBot on its doubles in real time, recorded, beside processes that compute all the time. At the
end of each keyframe the next event should still be to come: how far away it is then, and how long
keyframes take, is printed, and last how many activations waited for one. Exit status 1 if one did.
"""

import argparse
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import monotonic_ns
from typing import Any
from unittest.mock import patch

from benchmarks.loop.rates import assignments
from benchmarks.shared.results import (
    conditions,
    finish,
    positive,
)
from firmware_runtime.board.local_settings import board_in_force
from firmware_runtime.cli.arguments import positive as positive_number
from firmware_runtime.devs.time import seconds
from firmware_runtime.errors import Status
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.recording.blackbox.recorder import Recorder
from firmware_runtime.runs import recorded_edge
from firmware_runtime.runs.start import start_session

SUMMARY = "Whether an activation ever waits for a keyframe of the run's recording."


class WatchedRecorder(Recorder):
    """Notes of each keyframe how long it took and how far the next event was at its end."""

    spans: list[int]
    margins: list[int]
    """Ns each; below 0 is an event that was due before the keyframe's end."""

    def _take_keyframe(self, next_at: int) -> None:
        due_at, begun = self._schedule.due_at, monotonic_ns()
        super()._take_keyframe(next_at)
        if self._schedule.due_at != due_at:  # it was tried
            self.spans.append(monotonic_ns() - begun)
            self.margins.append(next_at - self._now())


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what this bench takes."""
    parser.add_argument("--rate", type=positive, default=999, metavar="HZ", help="default 999")
    parser.add_argument(
        "--seconds", type=positive_number, default=600.0, metavar="S", help="default 600"
    )
    parser.add_argument(
        "--neighbours", type=int, default=1, metavar="N", help="processes that compute; default 1"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    before = conditions()
    with ExitStack() as stack:
        for _ in range(arguments.neighbours):
            neighbour = subprocess.Popen([sys.executable, "-c", "while True: pass"])
            stack.callback(neighbour.wait)
            stack.callback(neighbour.kill)
        folder = Path(stack.enter_context(TemporaryDirectory(prefix="keyframes-bench-")))
        found = measured(folder, arguments.rate, arguments.seconds)
    report = {"conditions": before, "neighbours": arguments.neighbours, **found}
    finish(arguments, "keyframes", report, lines_of)
    return Status.MODEL_ERROR if report["waited"] else Status.OK


def measured(folder: Path, rate_hz: int, span_s: float) -> dict[str, Any]:
    """Run for so long; times in us."""
    WatchedRecorder.spans, WatchedRecorder.margins = [], []
    with patch.object(recorded_edge, "Recorder", WatchedRecorder):
        session = start_session(
            board_in_force("tachobot", assignments(rate_hz)),
            MonotonicClock(),
            doubles=True,
            statistics_path=folder / "bench.statistics",
            recording=folder / "bench.recording",
        )
    try:
        session.run(seconds(span_s))
    finally:
        session.close()
    figures = session.executive.statistics.figures()
    spans = [each / 1000 for each in WatchedRecorder.spans]
    margins = [each / 1000 for each in WatchedRecorder.margins]
    return {
        "rate_hz": rate_hz,
        "seconds": span_s,
        "keyframes": len(spans),
        "took_us": median(spans) if spans else None,
        "took_at_most_us": max(spans, default=None),
        "nearest_event_us": min(margins, default=None),
        "waited": sum(each < 0 for each in margins),
        "activations": figures.scheduled,
        "dropped": figures.skipped + figures.coalesced,
    }


def lines_of(report: Mapping[str, Any]) -> Iterator[str]:
    """The report in words."""
    where = f"{report['rate_hz']} Hz for {report['seconds']:g} s beside {report['neighbours']} busy"
    activations = f"{report['activations']} activations, {report['dropped']} of them dropped"
    yield f"{where} processes: {activations}"
    yield f"keyframes: {report['keyframes']}"
    if report["keyframes"]:
        yield (
            f"  one took {report['took_us']:.0f} us (median), {report['took_at_most_us']:.0f} us "
            f"at most; the next event was then {report['nearest_event_us']:.0f} us away or more"
        )
    yield f"activations that waited for a keyframe: {report['waited']}"
