"""`firmware-runtime doubles serve BOARD`: doubles in a process of their own."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

from firmware_runtime.board.struck_doubles import HasDevices
from firmware_runtime.cli.arguments import SubParsers, add_board, add_output_log, add_verb
from firmware_runtime.cli.chosen_board import chosen_board
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.hal.budget import WireClock
from firmware_runtime.system.messages import Notices
from firmware_runtime.system.signals import stop_on_signals
from sim_doubles.commands.fault import add_fault_to
from sim_doubles.commands.replay import add_replay_to
from sim_doubles.rigs.board_rig import DoublesRig, rig_for
from sim_doubles.rigs.chips import ChipsRig, placed
from sim_doubles.served.logs import OutputLog
from sim_doubles.served.server import DoublesServer, RealClock
from sim_doubles.served.service import DoublesService

HELP_GROUP = "run"
HELP_LINE = "Keep doubles in a process of their own."
CHIPS: Final = "chips"
"""What chips without a board are called, where a board has its name."""
_ABOUT = """
`run BOARD --doubles PATH` in another process then drives them, in real time, as often as you like:
killing it changes nothing here but what the chips themselves do without commands. The world goes on
too; a fresh one takes a fresh server. A signal ends it and removes the socket. Chips without a
board are on the bus i2c1 at 400 kHz, or on a port called as they are; their world swings gently.
With --usbip each I2C bus becomes an adapter of this machine, by a USB device that exists in this
process only: any program can use it, i2c-tools and smbus2 as well as `run`, through the kernel's
own I2C stack. That needs root and the modules vhci-hcd, i2c-tiny-usb and i2c-dev; a transaction
takes longer than on a real bus.
"""


class Chosen(NamedTuple):
    """Doubles to be served, what they are called, and what is on them."""

    name: str
    rig: DoublesRig
    devices: HasDevices


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Keep doubles of a board, or of chips, in a process of their own."
    verb = verbs.add_parser("doubles", help=summary, description=summary)
    actions = verb.add_subparsers(required=True, metavar="ACTION")
    add_fault_to(actions)
    add_replay_to(actions)
    about = "Serve a board's doubles, or those of single chips, on a Unix socket."
    serve = add_verb(actions, "serve", about, execute)
    serve.epilog = _ABOUT
    add_board(serve, required=False)
    serve.add_argument(
        "--chip",
        action="append",
        default=[],
        metavar="NAME[@0xNN]",
        dest="chips",
        help="a single chip instead of a board, at its usual address or another; may be repeated",
    )
    serve.add_argument(
        "--socket",
        type=Path,
        metavar="PATH",
        help="where to listen for `run`; with --usbip for `doubles fault`, by default at "
        "/run/BOARD.doubles or /run/chips.doubles",
    )
    serve.add_argument(
        "--usbip", action="store_true", help="plug them into this machine, as real I2C adapters"
    )
    add_output_log(serve)


def execute(arguments: argparse.Namespace) -> int:
    """Serve until a signal comes."""
    clock = RealClock()
    name, rig, devices = chosen = _chosen(arguments, clock)
    path = arguments.socket
    if arguments.usbip:
        _refuse_ports(chosen)
        _behind_the_kernel(chosen)
        path = path or Path(f"/run/{name}.doubles")
    elif path is None:
        raise ConfigError.of_one("doubles serve", "no place for `run`", expected="--socket PATH")
    with OutputLog(arguments.log, rig) as log:
        service = DoublesService(name, rig, clock, log, devices)
        with (
            DoublesServer(path, service, log, clock) as server,
            stop_on_signals(lambda _signal: server.stop()),
        ):
            log.event(0, "serving", board=name, monotonic_ns=clock.started_at)
            if arguments.usbip:
                from sim_doubles.usbip.plugged import plugged_in  # noqa: PLC0415 -- of few machines

                with plugged_in(name, list(rig.buses), service, server, clock) as nodes:
                    for bus, device in nodes.items():
                        log.event(clock(), "attached", bus=bus, device=str(device))
                        print(f"{name}: {bus} is {device}", flush=True)
                    Notices.from_environment().ready()
                    server.serve()
            else:
                print(f"serving {name} on {path}", flush=True)
                server.serve()
            log.event(clock(), "stopped")
    return Status.OK


def _chosen(arguments: argparse.Namespace, clock: WireClock) -> Chosen:
    """Make what the command line names. Raises ConfigError with every fault."""
    words: Sequence[str] = arguments.chips
    if (arguments.board is None) == (not words):
        named = "neither" if arguments.board is None else "both"
        raise ConfigError("doubles", [f"BOARD or --chip: {named} given; expected one of the two"])
    if words:
        if arguments.assignments:
            raise ConfigError("doubles", ["--set: with --chip there is no board; expected BOARD"])
        rig = ChipsRig(placed(words), clock)
        return Chosen(CHIPS, rig, rig)
    board = chosen_board(arguments.board, arguments.assignments)
    return Chosen(board.name, rig_for(board, clock), board)


def _behind_the_kernel(chosen: Chosen) -> None:
    """Load the kernel's modules, through whose adapter the doubles answer from now on."""
    from sim_doubles.usbip.host_controller import load_modules  # noqa: PLC0415 -- of few machines

    load_modules()
    for double in chosen.rig.buses.values():
        double.be_behind("i2c-tiny-usb")


def _refuse_ports(chosen: Chosen) -> None:
    faults = [
        f"ports.{name}: a serial port, expected I2C buses only; without --usbip there are ports too"
        for name in chosen.rig.ports
    ]
    if faults:
        raise ConfigError(chosen.name, faults)
