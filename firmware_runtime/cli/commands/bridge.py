"""`firmware-runtime bridge BOARD`: ports of a running robot over UDP."""

import argparse
from functools import partial
from pathlib import Path
from time import monotonic_ns

from firmware_runtime.cli.arguments import SubParsers, add_board, add_statistics, add_verb, whole
from firmware_runtime.cli.chosen_board import chosen_run
from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.links.bridge.bridge import Bridge
from firmware_runtime.links.bridge.broadcast import Route
from firmware_runtime.links.endpoint import endpoint
from firmware_runtime.links.key_file import read_key
from firmware_runtime.links.ports.datagrams import LARGEST_EVERY
from firmware_runtime.statistics.paths import default_path
from firmware_runtime.system.messages import Notices
from firmware_runtime.system.signals import UntilSignal, until_signal
from firmware_runtime.system.this_process import keep_off

LISTEN = "127.0.0.1:7300"
STATUS_EVERY = 2 * SECOND
_ABOUT = """
A datagram is one JSON object: {"port": "target", "value": 1.0} puts a value into an input
port of the model, {"watch": ["sensor.value"], "every": 10} has output ports sent to its sender for
ten seconds, {"list": true} answers with the ports there are. It waits for a run, and for the next.
With --key only datagrams that are signed with it are taken: `firmware-runtime send` and `watch`
sign them. Without a key it listens on a loopback address only.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Carry ports of a running robot over UDP: values in, messages out."
    verb = add_verb(verbs, "bridge", summary, execute)
    verb.epilog = _ABOUT
    add_board(verb)
    verb.add_argument(
        "--listen",
        default=LISTEN,
        metavar="ADDRESS:PORT",
        help=f"where to take datagrams; default {LISTEN}; another than loopback needs --key",
    )
    verb.add_argument(
        "--key",
        type=Path,
        metavar="FILE",
        help="take only what is signed with this key, which `firmware-runtime new key FILE` makes",
    )
    verb.add_argument(
        "--peer",
        action="append",
        default=[],
        metavar="ADDRESS:PORT",
        help="where the ports of --watch go unasked; nothing is taken from there; may be repeated",
    )
    verb.add_argument(
        "--watch", metavar="PORT[,PORT]", help="output ports for the peers, such as sensor.value"
    )
    verb.add_argument(
        "--every",
        type=partial(whole, least=1, most=LARGEST_EVERY),
        metavar="N",
        help="every N-th message of each; default every one",
    )
    add_statistics(verb)


def execute(arguments: argparse.Namespace) -> int:
    """Carry datagrams until a signal comes."""
    board, run = chosen_run(arguments.board, arguments.assignments)
    keep_off(board.settings.executive.cpus)
    route = _route(arguments, arguments.statistics or default_path(run))
    notices = Notices.from_environment()

    def log(what: str) -> None:
        print(f"bridge: {what}", flush=True)
        notices.status(what)

    bridge = Bridge(route, log)
    log(f"listening at {bridge.listens_at}")
    if route.key is not None:
        log(f"takes only what is signed with {arguments.key}")
    with until_signal() as signal:
        bridge.wake_by(signal.fileno())
        notices.ready()
        _carry(bridge, signal, notices)
    notices.stopping()
    bridge.close()
    return Status.OK


def _carry(bridge: Bridge, signal: UntilSignal, notices: Notices) -> None:
    """Work until the signal, and let the service's manager know how it goes."""
    status_at = 0
    while not signal.came:
        bridge.work()
        notices.alive()
        if monotonic_ns() >= status_at:
            status_at = monotonic_ns() + STATUS_EVERY
            notices.status(bridge.summary)


def _route(arguments: argparse.Namespace, statistics: Path) -> Route:
    """Raises ConfigError for addresses that are none or need a key, and for idle options."""
    watch = [] if arguments.watch is None else arguments.watch.split(",")
    if bool(watch) is not bool(arguments.peer):
        raise ConfigError("--watch and --peer", ["one without the other; expected both or neither"])
    if arguments.every is not None and not watch:
        raise ConfigError("--every", ["stands without --watch; expected both or neither"])
    listen = endpoint("--listen", arguments.listen)
    if arguments.key is None and not listen.is_loopback:
        fault = f"{listen} is open to other machines; expected --key FILE, or a loopback address"
        raise ConfigError.of_one("--listen", fault)
    return Route(
        robot=statistics,
        listen=listen,
        peers=[endpoint("--peer", peer) for peer in arguments.peer],
        watch=watch,
        every=arguments.every or 1,
        key=None if arguments.key is None else read_key(arguments.key, "--key"),
    )
