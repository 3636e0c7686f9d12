"""`firmware-runtime perfetto [BOARD|FILE] -o FILE.json`: what ran when, for Perfetto.

It reads what the loop has written anyway, in a process of its own, so the loop neither stops nor
slows down. With `--when-late` it polls the statistics ten times a second until an activation
was late.
"""

import argparse
import json
import math
import sys
from pathlib import Path
from time import monotonic, sleep

from firmware_runtime.cli.arguments import SubParsers, add_kept, add_verb, path_of, positive
from firmware_runtime.devs.time import MICROSECOND, seconds
from firmware_runtime.errors import ConfigError
from firmware_runtime.statistics.companions import Companion
from firmware_runtime.statistics.errors import BeingWrittenError, StatisticsFileError
from firmware_runtime.statistics.late_watch import Late, LateWatch
from firmware_runtime.statistics.number_formats import instant
from firmware_runtime.statistics.perfetto import chrome_trace, the_last
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.spans import read_spans
from firmware_runtime.statistics.statistics import RunState, Statistics
from firmware_runtime.status import Status

LOOK_EVERY_S = 0.1
AFTERMATH_S = 0.5
"""How long to go on after a late activation, so that the trace shows what came of it."""


STANDSTILL_S = 30.0
"""How long a run may stand still half way through its counting, once an activation was late."""


class _NothingHappened(Exception):
    """What was waited for did not come; says why not."""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    about = "Write what ran when, as a trace for Perfetto; the run goes on undisturbed."
    verb = add_verb(verbs, "perfetto", about, execute)
    add_kept(verb)
    verb.add_argument(
        "-o", "--output", type=Path, required=True, metavar="FILE.json", help="where to write it"
    )
    verb.add_argument(
        "--last", type=positive, metavar="SECONDS", help="only so much; default: all there is"
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
    kept = path_of(arguments.kept)
    trigger = None
    try:
        if arguments.when_late is not None:
            limit_ns = round(arguments.when_late * MICROSECOND)
            trigger = _wait(kept, limit_ns, arguments.wait or math.inf)
            sleep(AFTERMATH_S)
    except _NothingHappened as reason:
        print(f"firmware-runtime: {reason}; no trace was written", file=sys.stderr)
        return Status.NOTHING_HAPPENED
    except KeyboardInterrupt:
        print("firmware-runtime: interrupted; no trace was written", file=sys.stderr)
        return Status.INTERRUPTED
    write_trace(kept, arguments.output, arguments.last, trigger)
    return Status.OK


def write_trace(
    kept: Path, output: Path, last_s: float | None = None, trigger: Late | None = None
) -> None:
    """Write the trace of the run with its statistics at `kept`, or its last part; say so."""
    until = 0.0 if trigger is None else monotonic() + STANDSTILL_S
    _check_recorder(kept, until)
    recorded = read_spans(Companion.SPANS.beside(kept))
    if last_s is not None:
        recorded = the_last(recorded, seconds(last_s))
    trace = chrome_trace(recorded, _read(kept, until), trigger)
    try:
        output.write_text(json.dumps(trace, allow_nan=False), encoding="utf-8")
    except OSError as error:
        raise ConfigError(str(output), [f"cannot be written ({error.strerror})"]) from error
    first = min((each.begin_ns for each in recorded), default=0)
    end = max((each.end_ns for each in recorded), default=0)
    print(f"{output}: {len(recorded)} spans, from {instant(first)} to {instant(end)}")
    if trigger is not None:
        print(f"taken because of {trigger}")


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


def _check_recorder(kept: Path, until: float) -> None:
    """Refuse a run that keeps no record."""
    _read(kept, until)  # where there was no run, that is what to say
    if not Companion.SPANS.beside(kept).is_file():
        raise StatisticsFileError(
            f"{Companion.SPANS.beside(kept)}: no flight recorder's file beside the statistics; "
            "expected those of a run, not a copy, with recorded_spans over 0 under [executive] in "
            "board.toml"
        )


def _wait(kept: Path, limit_ns: int, longest_s: float) -> Late:
    """Look until an activation is later than the limit."""
    until = monotonic() + longest_s
    _check_recorder(kept, until)
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
