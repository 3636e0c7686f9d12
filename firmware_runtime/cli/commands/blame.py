"""`firmware-runtime blame [BOARD|FILE]`: why activations are late, and who ran instead, live."""

import argparse
import json
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from time import monotonic

from msgspec import to_builtins

from firmware_runtime.cli.arguments import (
    SubParsers,
    add_duration,
    add_kept,
    add_verb,
    path_of,
)
from firmware_runtime.cli.readers_gone import print_line
from firmware_runtime.errors import Status
from firmware_runtime.statistics.blame import sentence
from firmware_runtime.statistics.figures import WorstActivation
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.layout import ELAPSED, HEARTBEAT, WRITTEN
from firmware_runtime.statistics.number_formats import instant, microseconds, seconds
from firmware_runtime.statistics.ran_instead import RanInstead, ran_instead
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.system.signals import UntilSignal, until_signal
from firmware_runtime.system.switch_trace import NoTracingError, SwitchTrace, switch_trace

LOOK_EVERY_S = 0.2
MARGIN_NS = 500_000
"""How inexactly the run's clock is known beside the trace's, ns."""
_ABOUT = """
It reads what the run writes anyway, in a process of its own, and prints a line for each activation
that comes among the worst with a cause. With the right to the kernel's tracing (root's, as a rule)
it also names the threads that had the processor while the loop could have run; without, it says
that they are unknown. It costs each switch between threads a little, and ends with it. Of a run
that is over there is nothing to follow: it prints those of the worst that have a cause, and ends
with status 3.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Follow a run: why its activations are late, and what ran instead."
    verb = add_verb(verbs, "blame", summary, execute)
    verb.epilog = _ABOUT
    add_kept(verb)
    add_duration(verb, "default: to its end", dest="seconds")
    verb.add_argument("--json", action="store_true", help="print a JSON object a line")


def execute(arguments: argparse.Namespace) -> int:
    """Follow the run to its end, for so long, or until a signal comes."""
    kept = path_of(arguments.kept)
    statistics = read_statistics(kept)
    if not _is_under_way(statistics):
        return _of_one_that_is_over(kept, statistics, as_json=arguments.json)
    ends_at = monotonic() + (arguments.seconds or float("inf"))
    with ExitStack() as open_:
        signal = open_.enter_context(until_signal())
        follower = Follower(kept, statistics, _trace(open_, statistics))
        while _is_under_way(statistics) and monotonic() < ends_at and not _waited(signal):
            statistics = read_statistics(kept)
            for late in follower.new_in(statistics):
                _print(late, as_json=arguments.json)
    return Status.INTERRUPTED if signal.name == "SIGINT" else Status.OK


def _of_one_that_is_over(kept: Path, statistics: Statistics, *, as_json: bool) -> Status:
    """Say how it ended, and print what is still known of its late activations."""
    figures = statistics.figures()
    run = figures.conditions.run
    is_told = run.reason is not None and run.state != "ended"
    how = f"{run.state}: {run.reason}" if is_told else run.state
    said = f"this run is over ({how}), after {seconds(run.elapsed_s)}"
    late = sorted((each for each in figures.worst if each.blame is not None), key=_instant)
    known = f"{len(late)} of its worst activations have a cause" if late else "no cause is known"
    expected = "expected one under way, to find what ran instead"
    print_line(f"firmware-runtime: {kept}: {said}; {expected}; {known}", sys.stderr)
    for each in late:
        _print(LateOne(each, None), as_json=as_json)
    return Status.NO_DEVICE


def _print(late: "LateOne", *, as_json: bool) -> None:
    print(json.dumps(late.as_json()) if as_json else late.text(), flush=True)


def _waited(signal: UntilSignal) -> bool:
    return signal.wait(LOOK_EVERY_S)


def _trace(open_: ExitStack, statistics: Statistics) -> SwitchTrace | None:
    """The trace of the run's thread, or None, with the reason on standard error."""
    try:
        return open_.enter_context(switch_trace(statistics.header.writer.pid))
    except NoTracingError as error:
        print(f"firmware-runtime: {error}; what ran instead is unknown", file=sys.stderr)
        return None


class LateOne:
    """A late activation with its cause; `instead` is None where nothing was traced."""

    def __init__(self, activation: WorstActivation, instead: list[RanInstead] | None) -> None:
        self._activation = activation
        self._instead = instead

    def text(self) -> str:
        """It in a line."""
        late, blame = self._activation, self._activation.blame
        why = "unknown" if blame is None else sentence(blame)
        return (
            f"{late.model} at {instant(late.t_ns)}, {microseconds(late.lateness_us)} late, step "
            f"{microseconds(late.step_us)}: {why}; ran instead: {self._who()}"
        )

    def as_json(self) -> dict[str, object]:
        """It as JSON: the entry of `worst` in the statistics, and `ran_instead`."""
        return {**to_builtins(self._activation), "ran_instead": to_builtins(self._instead)}

    def _who(self) -> str:
        if self._instead is None:
            return "unknown"
        return ", ".join(each.text() for each in self._instead[:3]) or "nothing"


class Follower:
    """Finds what is new among a run's worst activations, and what ran instead."""

    def __init__(self, kept: Path, statistics: Statistics, trace: SwitchTrace | None) -> None:
        self._kept = kept
        self._pid = statistics.header.writer.pid
        self._trace = trace
        self._seen = {each.t_ns for each in statistics.figures().worst}

    def new_in(self, statistics: Statistics) -> Iterator[LateOne]:
        """Those that have come since the last time and have a cause, in order of time."""
        worst = [each for each in statistics.figures().worst if each.t_ns not in self._seen]
        fresh = sorted((each for each in worst if each.blame is not None), key=_instant)
        self._seen |= {each.t_ns for each in worst}
        switches = self._trace.read() if self._trace is not None and fresh else None
        began = run_began(statistics)
        for each in fresh:
            since = began + each.t_ns - MARGIN_NS
            until = since + round((each.lateness_us + each.step_us) * 1000) + 2 * MARGIN_NS
            found = None if switches is None else ran_instead(switches, self._pid, since, until)
            yield LateOne(each, found)


def run_began(statistics: Statistics) -> int:
    """When the run's clock was at zero, CLOCK_MONOTONIC, ns; of real time."""
    cells = statistics.cells
    return max(cells[WRITTEN], cells[HEARTBEAT]) - cells[ELAPSED]


def _instant(activation: WorstActivation) -> int:
    return activation.t_ns


def _is_under_way(statistics: Statistics) -> bool:
    return statistics.state is RunState.RUNNING and statistics.writer_alive
