"""`firmware-runtime perfetto [RUN] -o FILE.json`: what ran when, for Perfetto.

It runs the recording of a run again, in a process of its own, so a loop that is under way neither
stops nor slows down. With `--when-late` it polls the statistics ten times a second until an
activation was late.
"""

import argparse
import json
import math
import re
import sys
from pathlib import Path
from time import monotonic, sleep

from firmware_runtime.cli.arguments import SubParsers, add_output, add_verb, path_of, positive
from firmware_runtime.devs.time import MICROSECOND, SECOND, seconds
from firmware_runtime.errors import BeingWrittenError, ConfigError, StatisticsFileError, Status
from firmware_runtime.recording.blackbox.listing import span_of
from firmware_runtime.recording.blackbox.locations import find_recording, recording_beside
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from firmware_runtime.recording.board_of_recording import board_of
from firmware_runtime.recording.exports.observed_run import missing_in, moments_of
from firmware_runtime.recording.exports.perfetto import chrome_trace
from firmware_runtime.recording.replay.verdict import Stretch
from firmware_runtime.statistics.file_header import RunState
from firmware_runtime.statistics.late_watch import Late, LateWatch
from firmware_runtime.statistics.number_formats import instant
from firmware_runtime.statistics.paths import SUFFIX
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.system.atomic_file import keep_output

LAST = 15 * SECOND
"""How much of a run a trace shows unless that is said."""
LOOK_EVERY_S = 0.1
AFTERMATH_S = 0.5
"""How long to go on after a late activation, so that the trace shows what came of it."""


_INCIDENT = re.compile(r"-[a-z]+-\d+$")
"""What follows the number of the run in the name of a piece that `record` has kept."""


class _NothingHappened(Exception):
    """What was waited for did not come; says why not."""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    about = "Write what ran when, as a trace for Perfetto; a run that is under way goes on."
    verb = add_verb(verbs, "perfetto", about, execute)
    verb.add_argument(
        "kept",
        metavar="RUN",
        nargs="?",
        help="a board's name for its last run, a name that `recordings` shows, a recording's file "
        f"or the run's statistics (FILE{SUFFIX}); default: whatever ran last",
    )
    add_output(verb, "where to write it", metavar="FILE.json", required=True)
    verb.add_argument(
        "--last",
        type=positive,
        default=LAST / SECOND,
        metavar="SECONDS",
        help="how much of the run, up to its last step (15)",
    )
    verb.add_argument(
        "--when-late",
        type=positive,
        metavar="US",
        help="wait for an activation later than this, then take the trace",
    )
    verb.add_argument(
        "--wait",
        type=positive,
        metavar="SECONDS",
        help="with --when-late: give up after so long",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Write the trace, at once or when an activation was late."""
    if arguments.wait is not None and arguments.when_late is None:
        raise ConfigError("perfetto", ["--wait belongs to --when-late"])
    trigger = None
    try:
        if arguments.when_late is None:
            path = _recording(arguments.kept)
        else:
            kept = path_of(arguments.kept)
            path = recording_beside_statistics(kept)
            limit_ns = round(arguments.when_late * MICROSECOND)
            trigger = _wait(kept, limit_ns, arguments.wait or math.inf)
            sleep(AFTERMATH_S)
    except _NothingHappened as reason:
        print(f"firmware-runtime: {reason}; no trace was written", file=sys.stderr)
        return Status.NOTHING_HAPPENED
    except KeyboardInterrupt:
        print("firmware-runtime: interrupted; no trace was written", file=sys.stderr)
        return Status.INTERRUPTED
    write_trace(path, arguments.output, seconds(arguments.last), trigger)
    return Status.OK


def write_trace(path: Path, output: Path, last: int = LAST, trigger: Late | None = None) -> None:
    """Write the trace of the last so many ns of a recording; say so, and what it lacks."""
    recording = read_recording(path)
    begin = max(0, span_of(recording)[1] - last)
    board = board_of(recording.header)
    steps = [each for each in moments_of(recording, board, Stretch(begin)) if each.is_step]
    trace = chrome_trace(board.name, steps, _statistics_of(recording), trigger)
    keep_output(output, json.dumps(trace, allow_nan=False).encode())
    for fault in missing_in(recording, begin):
        print(f"firmware-runtime: not whole: {fault}", file=sys.stderr)
    functions = sum(len(each.ran) for each in steps)
    first, end = (steps[0].begin, steps[-1].end) if steps else (0, 0)
    passed = f"from {instant(first)} to {instant(end)}"
    print(f"{output}: {len(steps)} steps, {functions} functions, {passed}")
    if trigger is not None:
        print(f"taken because of {trigger}")


def recording_beside_statistics(kept: Path) -> Path:
    """The recording of the run with its statistics there. Raises ConfigError."""
    path = recording_beside(kept)
    if not path.is_file():
        fault = f"no recording of the run beside {kept}"
        expected = "expected one with recording.minutes over 0 in its board.toml"
        raise ConfigError.of_one(str(path), f"{fault}; {expected}")
    return path


def _recording(kept: str | None) -> Path:
    """The recording that is meant: itself, by its name or board, or by its run's statistics."""
    if kept is None or kept.endswith(SUFFIX):
        return recording_beside_statistics(path_of(kept))
    return find_recording(kept)


def _statistics_of(recording: Recording) -> Statistics | None:
    """Of its run, beside it, or where `record` keeps them; None if those are another run's."""
    path = recording.path
    stems = path.stem, _INCIDENT.sub("", path.stem)
    for each in dict.fromkeys(path.with_name(f"{stem}{SUFFIX}") for stem in stems):
        try:
            statistics = read_statistics(each)
        except StatisticsFileError:
            continue
        if recording.header.run.endswith(f"-{statistics.header.writer.pid}"):
            return statistics
    return None


def _read(kept: Path, until: float) -> Statistics:
    """The statistics; of a run that is stopped half way through its counting, when it goes on.

    Raises BeingWrittenError if it has not up to an instant of `monotonic`.
    """
    while True:
        try:
            return read_statistics(kept)
        except BeingWrittenError:
            if monotonic() >= until:
                raise


def _wait(kept: Path, limit_ns: int, longest_s: float) -> Late:
    """Look until an activation is later than the limit."""
    until = monotonic() + longest_s
    statistics = _read(kept, until)
    watch = LateWatch(limit_ns, statistics)
    limit = f"over {limit_ns / MICROSECOND:.10g} us late"
    while _is_under_way(statistics):
        if monotonic() >= until:
            raise _NothingHappened(f"no activation was {limit} within {longest_s:g} s")
        sleep(LOOK_EVERY_S)
        statistics = _read(kept, until)
        if late := watch.new_in(statistics):
            return late
    raise _NothingHappened(f"the run is not under way, and no activation was {limit} meanwhile")


def _is_under_way(statistics: Statistics) -> bool:
    return statistics.state is RunState.RUNNING and statistics.writer_alive
