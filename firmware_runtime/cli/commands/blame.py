"""`firmware-runtime blame [BOARD|FILE]`: why activations are late, and who ran instead, live."""

import argparse
import json
import sys
from contextlib import ExitStack
from pathlib import Path
from time import monotonic

from firmware_runtime.cli.arguments import (
    SubParsers,
    add_duration,
    add_kept,
    add_verb,
    path_of,
)
from firmware_runtime.errors import Status
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.late_followed import Follower, LateOne, instant_of
from firmware_runtime.statistics.number_formats import seconds
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.system.signals import UntilSignal, until_signal
from firmware_runtime.system.switch_trace import NoTracingError, SwitchTrace, switch_trace
from firmware_runtime.system.terminal import print_line

LOOK_EVERY_S = 0.2
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
    late = sorted((each for each in figures.worst if each.blame is not None), key=instant_of)
    known = f"{len(late)} of its worst activations have a cause" if late else "no cause is known"
    expected = "expected one under way, to find what ran instead"
    print_line(f"firmware-runtime: {kept}: {said}; {expected}; {known}", sys.stderr)
    for each in late:
        _print(LateOne(each, None), as_json=as_json)
    return Status.NO_DEVICE


def _print(late: LateOne, *, as_json: bool) -> None:
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


def _is_under_way(statistics: Statistics) -> bool:
    return statistics.state is RunState.RUNNING and statistics.writer_alive
