"""`firmware-runtime doubles serve BOARD`: doubles in a process of their own."""

import argparse
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_output_log, add_verb
from firmware_runtime.errors import Status
from firmware_runtime.system.signals import stop_on_signals
from sim_doubles.commands.chosen import add_choice, chosen
from sim_doubles.commands.fault import add_fault_to
from sim_doubles.commands.replay import add_replay_to
from sim_doubles.commands.usbip import add_usbip_to
from sim_doubles.served.logs import OutputLog
from sim_doubles.served.server import DoublesServer, RealClock
from sim_doubles.served.service import DoublesService

_ABOUT = """
`run BOARD --doubles PATH` in another process then drives them, in real time, as often as you like:
killing it changes nothing here but what the chips themselves do without commands. The world goes on
too; a fresh one takes a fresh server. A signal ends it and removes the socket. Chips without a
board are on the bus i2c1 at 400 kHz, or on a port called as they are; their world swings gently.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Keep doubles of a board, or of chips, in a process of their own."
    verb = verbs.add_parser("doubles", help=summary, description=summary)
    actions = verb.add_subparsers(required=True, metavar="ACTION")
    add_fault_to(actions)
    add_replay_to(actions)
    add_usbip_to(actions)
    serve = add_verb(
        actions,
        "serve",
        "Serve a board's doubles, or those of single chips, on a Unix socket.",
        execute,
    )
    serve.epilog = _ABOUT
    add_choice(serve)
    serve.add_argument(
        "--socket", type=Path, required=True, metavar="PATH", help="where to listen for `run`"
    )
    add_output_log(serve)


def execute(arguments: argparse.Namespace) -> int:
    """Serve until a signal comes."""
    clock = RealClock()
    name, rig = chosen(arguments, clock)
    with OutputLog(arguments.log, rig) as log:
        service = DoublesService(name, rig, clock, log)
        with (
            DoublesServer(arguments.socket, service, log, clock) as server,
            stop_on_signals(lambda _signal: server.stop()),
        ):
            log.event(0, "serving", board=name, monotonic_ns=clock.started_at)
            print(f"serving {name} on {arguments.socket}", flush=True)
            server.serve()
            log.event(clock(), "stopped")
    return Status.OK
