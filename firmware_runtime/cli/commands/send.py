"""`firmware-runtime send` and `watch`: values into ports of a running robot, and out of them."""

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from itertools import islice
from pathlib import Path

import msgspec

from firmware_runtime.cli.arguments import (
    ADDRESS,
    SubParsers,
    add_duration,
    add_key,
    add_verb,
    whole,
)
from firmware_runtime.cli.chosen_board import chosen_run
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.links.ports.datagrams import LARGEST_EVERY, message_of
from firmware_runtime.links.ports.ports_client import PortsClient
from firmware_runtime.statistics.json_values import is_json
from firmware_runtime.statistics.paths import SUFFIX, default_path

_COUNT = partial(whole, least=1, most=LARGEST_EVERY)
_ABOUT = """
`show BOARD --ports` lists the ports there are. BOARD is a robot that runs on this computer,
BOARD.ROLE the end of one that runs in two processes and has no hardware, such as
tachobot.controller. ADDRESS:PORT is a bridge, on any: one that is not on this computer has a key,
and --key names a copy of it.
"""


def add_to(verbs: SubParsers) -> None:
    """Add both verbs to the command line."""
    send = add_verb(verbs, "send", "Put values into input ports of a running robot.", _send)
    _add_place(send)
    send.add_argument(
        "values",
        nargs="+",
        metavar="PORT=VALUE",
        help="such as target=0.5; a value is JSON, or the name of an enumeration's member",
    )
    watch = add_verb(verbs, "watch", "Print what ports of a running robot send, as JSON.", _watch)
    _add_place(watch)
    watch.add_argument("ports", nargs="+", metavar="PORT", help="such as sensor.value")
    watch.add_argument(
        "--every", type=_COUNT, default=1, metavar="N", help="every N-th message of each port"
    )
    watch.add_argument("--count", type=_COUNT, metavar="N", help="end after so many messages")
    add_duration(watch, "end after so long", dest="for_s")


def _add_place(verb: argparse.ArgumentParser) -> None:
    verb.epilog = _ABOUT
    verb.add_argument(
        "place",
        metavar="BOARD|FILE|ADDRESS:PORT",
        help="a robot on this computer, by its board or its statistics; or a bridge to one",
    )
    add_key(verb)


def _send(arguments: argparse.Namespace) -> int:
    """Put in each value; say which arrived."""
    pairs = [_pair(text) for text in arguments.values]
    with _connected(arguments) as robot:
        for port, value in pairs:
            robot.put(port, value)
            print(f"{port}: {message_of(value=value).decode()[9:-1]} has arrived", flush=True)
    return Status.OK


def _watch(arguments: argparse.Namespace) -> int:
    """Print messages until there are enough, or the time is up."""
    with _connected(arguments) as robot:
        messages = robot.watch(arguments.ports, arguments.every, arguments.for_s)
        for message in islice(messages, arguments.count):
            print(msgspec.json.encode(message).decode(), flush=True)
    return Status.OK


@contextmanager
def _connected(arguments: argparse.Namespace) -> Iterator[PortsClient]:
    where: str | Path = arguments.place
    if arguments.place.endswith(SUFFIX):
        where = Path(arguments.place)
    elif not ADDRESS.fullmatch(arguments.place):
        where = default_path(chosen_run(arguments.place)[1])
    with PortsClient(where, arguments.key) as robot:
        yield robot


def _pair(text: str) -> tuple[str, object]:
    """A port's name and the value for it. Raises ConfigError."""
    port, equals, value = text.partition("=")
    if not (port and equals):
        raise ConfigError.of_one(text, "expected PORT=VALUE, such as target=0.5")
    return port, msgspec.json.decode(value) if is_json(value) else value
