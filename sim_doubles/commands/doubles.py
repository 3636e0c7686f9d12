"""`firmware-runtime doubles serve BOARD`: a board's doubles in a process of their own."""

import argparse
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_board, add_output_log, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.status import Status
from firmware_runtime.system.signals import stop_on_signals
from sim_doubles.commands.fault import add_fault_to
from sim_doubles.commands.usbip import add_usbip_to
from sim_doubles.rigs.rig import rig_for
from sim_doubles.served.output_log import OutputLog
from sim_doubles.served.server import DoublesServer, RealClock
from sim_doubles.served.service import DoublesService

_ABOUT = """
`run BOARD --doubles PATH` in another process then drives them, in real time, as often as you like:
killing it changes nothing here but what the chips themselves do without orders. The world goes on
too; a fresh one takes a fresh server. A signal ends it and removes the socket.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Keep a board's doubles in a process of their own."
    verb = verbs.add_parser("doubles", help=summary, description=summary)
    actions = verb.add_subparsers(required=True, metavar="ACTION")
    add_fault_to(actions)
    add_usbip_to(actions)
    serve = add_verb(actions, "serve", "Serve a board's doubles on a Unix socket.", execute)
    serve.epilog = _ABOUT
    add_board(serve)
    serve.add_argument(
        "--socket", type=Path, required=True, metavar="PATH", help="where to listen for `run`"
    )
    add_output_log(serve)


def execute(arguments: argparse.Namespace) -> int:
    """Serve until a signal comes."""
    board = chosen_board(arguments.board, arguments.assignments)
    clock = RealClock()
    rig = rig_for(board, clock)
    with OutputLog(arguments.log, rig) as log:
        service = DoublesService(board.name, rig, clock, log)
        with (
            DoublesServer(arguments.socket, service, log, clock) as server,
            stop_on_signals(lambda _signal: server.stop()),
        ):
            log.event(0, "serving", board=board.name, monotonic_ns=clock.started_at)
            print(f"serving {board.name} on {arguments.socket}", flush=True)
            server.serve()
            log.event(clock(), "stopped")
    return Status.OK
