"""`firmware-runtime doubles replay RUN`: a recorded bus, served to any program."""

import argparse
import sys
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_recorded, add_verb, second
from firmware_runtime.devs.time import NEVER, SECOND
from firmware_runtime.errors import Status
from firmware_runtime.recording.blackbox.locations import find_recording
from firmware_runtime.recording.blackbox.reader import Recording, read_recording
from firmware_runtime.system.signals import stop_on_signals
from sim_doubles.recorded.lines import Rules
from sim_doubles.recorded.service import RecordedService
from sim_doubles.recorded.stops import stops_of
from sim_doubles.recorded.traffic import Deviation, Deviations, Traffic, traffic_of
from sim_doubles.served.logs import EventLog
from sim_doubles.served.server import DoublesServer, RealClock

_ABOUT = """
Any program that uses served doubles, `run BOARD --doubles PATH` among them, then gets on each line
what the run got, in that order and at once: bytes, or the errno of a transaction that failed. One
that is not the recorded one at that point is said on standard error, and refused (EPROTO) with
nothing moved on; with --warn it is answered by the next recorded one of that device and shape.
What switches the robot off is always taken. It ends by a signal, when all has been asked for and
the last client has gone, or when there was no program for --wait seconds. Exit status 0: all was
asked for as recorded; 1: not so.
"""


def add_replay_to(actions: SubParsers) -> None:
    """Add this action of `doubles`."""
    summary = "Serve the lines of a recorded run, as they answered then."
    verb = add_verb(actions, "replay", summary, execute)
    verb.epilog = _ABOUT
    add_recorded(verb)
    verb.add_argument(
        "--socket", type=Path, required=True, metavar="PATH", help="where to listen for programs"
    )
    verb.add_argument(
        "--lines",
        nargs="+",
        default=[],
        metavar="NAME",
        help="these buses and ports only, the others are absent; default: all",
    )
    verb.add_argument(
        "--warn",
        action="store_true",
        help="do not refuse what is not the recorded transaction at that point: answer it by the "
        "next recorded one of that device and shape, and say so",
    )
    verb.add_argument(
        "--from",
        type=second,
        default=0,
        metavar="T",
        dest="begin",
        help="begin with the first transaction at this second of the run, or after it",
    )
    verb.add_argument(
        "--wait",
        type=second,
        default=60 * SECOND,
        metavar="S",
        help="end when there was no program for so many seconds (60); 0: never",
    )
    verb.add_argument(
        "--log",
        type=Path,
        default=Path("/dev/null"),
        metavar="FILE",
        help="write clients and every deviation as JSON lines, each at once",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Serve until it is over or a signal comes; say how it went."""
    recording = read_recording(find_recording(arguments.run))
    traffic = traffic_of(recording, arguments.lines, arguments.begin)
    for fault in recording.faults():
        print(f"warning: the recording is not whole: {fault}", file=sys.stderr, flush=True)
    clock = RealClock()
    with EventLog(arguments.log) as log:
        deviations = Deviations(lambda each: _report(each, log, clock))
        rules = Rules(not arguments.warn, stops_of(recording), deviations)
        table = recording.header.table
        service = RecordedService(table.get("name", recording.header.kind), traffic, rules)
        with (
            DoublesServer(arguments.socket, service, log, clock) as server,
            stop_on_signals(lambda _signal: server.stop()),
        ):
            service.over, service.left = lambda: _say_over(traffic, deviations), server.stop
            log.event(0, "serving", run=recording.header.run, monotonic_ns=clock.started_at)
            print(_beginning(recording, traffic, arguments.socket), flush=True)
            server.serve(arguments.wait or NEVER)
            log.event(clock(), "stopped", over=service.is_over, deviations=deviations.count)
    return _ended(service, traffic, deviations)


def _beginning(recording: Recording, traffic: Traffic, socket: Path) -> str:
    entries = [each for line in traffic.lines.values() for each in line]
    first, last = (pick(each.transfer.at for each in entries) / SECOND for pick in (min, max))
    lines = ", ".join(traffic.lines)
    what = f"{traffic.total} transactions of {lines}, {first:.3f} to {last:.3f} s of the run"
    return f"replaying {recording.header.run} on {socket}: {what}"


def _report(deviation: Deviation, log: EventLog, clock: RealClock) -> None:
    print(deviation, file=sys.stderr, flush=True)
    log.event(clock(), "deviation", **deviation.as_json())


def _say_over(traffic: Traffic, deviations: Deviations) -> None:
    how = f"{deviations.count} were not as recorded" if deviations.count else "all as recorded"
    print(f"the recording is over: {traffic.total} transactions, {how}", flush=True)


def _ended(service: RecordedService, traffic: Traffic, deviations: Deviations) -> int:
    number = service.next_number
    if number is not None:
        what = f"before transaction {number} of {traffic.total}, deviations: {deviations.count}"
        print(f"ended {what}", file=sys.stderr)
    if number is None and deviations.count == 0:
        return Status.OK
    return Status.MODEL_ERROR
