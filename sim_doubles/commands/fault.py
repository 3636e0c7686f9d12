"""`firmware-runtime doubles fault KIND`: let a bus of served doubles fail for a while."""

import argparse
import errno
from pathlib import Path
from typing import Final

from firmware_runtime.cli.arguments import SubParsers, add_verb, positive
from firmware_runtime.devs.time import seconds
from firmware_runtime.errors import Status
from firmware_runtime.hal.served.client import strike
from firmware_runtime.hal.served.connection import Connection
from firmware_runtime.hal.served.packets import Strike
from firmware_runtime.hal.wire_errors import EREMOTEIO

KINDS: Final = {
    "nack": EREMOTEIO,
    "stuck": errno.ETIMEDOUT,
    "arbitration": errno.EAGAIN,
    "fault": errno.EIO,
}
"""Errors of an adapter: no acknowledge, the bus is held, another controller won, its own."""


def add_fault_to(actions: SubParsers) -> None:
    """Add this action of `doubles`."""
    summary = "Let a bus of served doubles fail from now on, for a while."
    verb = add_verb(actions, "fault", summary, execute)
    verb.add_argument("kind", choices=list(KINDS), help="what the adapter reports")
    verb.add_argument(
        "--socket", type=Path, required=True, metavar="PATH", help="where the doubles are served"
    )
    verb.add_argument("--bus", default="", help="the bus's name in board.toml; default: every bus")
    verb.add_argument(
        "--address", type=_address, metavar="0xNN", help="one chip only; default: all on the bus"
    )
    verb.add_argument(
        "--for",
        type=positive,
        default=1.0,
        metavar="SECONDS",
        dest="span_s",
        help="how long it lasts (1)",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Ask for it; the server's log has when it began and ends."""
    connection = Connection(arguments.socket)
    span = seconds(arguments.span_s)
    asked = Strike(arguments.bus, KINDS[arguments.kind], span, arguments.address)
    strike(connection.ask, asked)
    connection.close()
    where = "" if arguments.address is None else f" 0x{arguments.address:02x}"
    which = arguments.bus or "every bus"
    print(f"{which}{where}: {arguments.kind} for {arguments.span_s:g} s from now")
    return Status.OK


def _address(text: str) -> int:
    try:
        address = int(text, 0)
    except ValueError:
        address = -1
    if not 0 <= address <= 0x7F:
        raise argparse.ArgumentTypeError(f"{text!r}: expected an address such as 0x40")
    return address
