"""`firmware-runtime dover BOARD`: numbers of a running robot for PowerDEVS, over UDP."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from firmware_runtime.cli.arguments import SubParsers, add_statistics, add_verb
from firmware_runtime.cli.chosen_board import chosen_run
from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.links.dover.bridge import DoverBridge
from firmware_runtime.models.dover import HIGHEST_PORT
from firmware_runtime.statistics.paths import default_path
from firmware_runtime.system.signals import until_signal
from firmware_runtime.system.terminal import print_line
from firmware_runtime.system.this_process import keep_off
from firmware_runtime.system.whole_numbers import whole_number

_ABOUT = """
Each number has a UDP port of this computer, and is the text that C's %f prints, six decimals: what
sndDOVER sends and rcvDOVER takes. A number of a value that has parts is named by them, such as
sensor.value.x. There is no key and no time in it, so it stays on this computer.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Carry numbers of a running robot to and from UDP, as sndDOVER and rcvDOVER do."
    verb = add_verb(verbs, "dover", summary, execute)
    verb.epilog = _ABOUT
    verb.add_argument("board", metavar="BOARD", help="a robot that runs on this computer")
    verb.add_argument(
        "--send",
        action="append",
        default=[],
        metavar="SIGNAL=PORT",
        help="send this number of an output port to a UDP port; may be repeated",
    )
    verb.add_argument(
        "--take",
        action="append",
        default=[],
        metavar="NAME=PORT",
        help="put what comes to a UDP port into this input port; may be repeated",
    )
    add_statistics(verb)


def execute(arguments: argparse.Namespace) -> int:
    """Carry until a signal comes, or the run has gone."""
    sends, takes = _ports("--send", arguments.send), _ports("--take", arguments.take)
    if not sends and not takes:
        raise ConfigError.of_one("dover", "nothing to carry", expected="--send or --take")
    if both := set(sends.values()) & set(takes.values()):
        fault = f"port {min(both)} is in --send and in --take, so the robot would receive its own"
        raise ConfigError.of_one("dover", fault, expected="two ports")
    path = arguments.statistics or _statistics_of(arguments.board)
    bridge = DoverBridge(path, sends, takes, _say)
    print(f"dover: carries {len(sends)} numbers out and {len(takes)} in", flush=True)
    try:
        with until_signal() as signal:
            bridge.wake_by(signal.fileno())
            while not signal.came:
                bridge.work()
    finally:
        bridge.close()
        print(f"dover: sent {bridge.sent}, taken {bridge.taken}, refused {bridge.refused}")
    return Status.OK


def _statistics_of(run: str) -> Path:
    """Where the run keeps them; from now on this process keeps off its processors."""
    board, name = chosen_run(run)
    keep_off(board.settings.executive.cpus)
    return default_path(name)


def _say(sentence: str) -> None:
    print_line(f"dover: {sentence}", sys.stderr)


def _ports(option: str, stated: Sequence[str]) -> dict[str, int]:
    """UDP ports by name. Raises ConfigError for all that are none."""
    found: dict[str, int] = {}
    faults = []
    for text in stated:
        name, _, port = text.partition("=")
        number = whole_number(port, HIGHEST_PORT)
        if not name or not number:
            faults.append(f"{text}: expected NAME=PORT, such as target=62001")
        elif name in found:
            faults.append(f"{name}: stated twice; expected one port")
        else:
            found[name] = number
    if faults:
        raise ConfigError(option, faults)
    return found
