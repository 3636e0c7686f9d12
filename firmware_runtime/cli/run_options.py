"""The options of `firmware-runtime run`, by kind; and the clock that they ask for."""

import argparse
from collections.abc import Iterator
from functools import partial
from math import isfinite
from pathlib import Path

from msgspec import json

from firmware_runtime.cli.arguments import add_duration, add_statistics, positive, speed, whole
from firmware_runtime.cli.chosen_model import is_model
from firmware_runtime.devs.time import seconds
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.runs import options
from firmware_runtime.runs.options import clock_faults
from firmware_runtime.runs.planned_inputs import PlannedInput
from firmware_runtime.statistics.json_values import is_json

_LOOP_S = 0.01
_FOR_A_ROBOT = ("doubles", "arm", "supervised", "record", "role", "link", "loop")
"""Options that say something about hardware, or about a robot's two ends."""


def add_run_options(verb: argparse.ArgumentParser) -> None:
    """Add them, but for those of stages and inputs."""
    _add_choices(verb)
    _add_link(verb)
    _add_files(verb)
    verb.add_argument("--json", action="store_true", help="print result and statistics as JSON")
    verb.add_argument(
        "--loop",
        type=positive,
        nargs="?",
        const=_LOOP_S,
        metavar="SECONDS",
        help="with --role: in place of the board's model a ramp, a value every so often (default "
        f"{_LOOP_S:g}), that is sent out and back, as the ends of `experiment loop-delay` do",
    )
    for by_a_stage in ("--report-to", "--called-at"):
        verb.add_argument(by_a_stage, type=int, help=argparse.SUPPRESS)
    _add_model(verb)


def _add_choices(verb: argparse.ArgumentParser) -> None:
    """Add what drives, in which time, for how long, and who may arm."""
    verb.add_argument(
        "--doubles",
        type=Path,
        nargs="?",
        const=True,
        default=False,
        metavar="PATH",
        help="run against register-level doubles of its chips: made for this run, or those that "
        "`doubles serve` keeps at PATH, with their own --set and no world.* in a trace",
    )
    verb.add_argument(
        "--clock",
        choices=options.CLOCKS,
        help="real time (default); virtual time, as fast as it goes; or real time times --speed",
    )
    verb.add_argument(
        "--speed", type=speed, metavar="N", help="how many times as fast, with --clock scaled"
    )
    add_duration(
        verb, "robot time to run for; default on doubles as the board says, else until stopped"
    )
    verb.add_argument(
        "--arm",
        action="store_true",
        help="arm it as soon as nothing speaks against it, whatever the board says",
    )
    verb.add_argument(
        "--supervised", action="store_true", help="on doubles too, drive outputs only when armed"
    )


def _add_files(verb: argparse.ArgumentParser) -> None:
    """Add the files that a run leaves."""
    verb.add_argument(
        "--trace", type=Path, metavar="FILE", help="write every message of every port as JSON lines"
    )
    verb.add_argument(
        "--record",
        type=Path,
        metavar="FILE",
        help="keep the recording that every run leaves in this file too, once the run is over",
    )
    add_statistics(
        verb, "where to keep the statistics; default: where `stats` looks, none in virtual time"
    )
    verb.add_argument(
        "--plot",
        type=Path,
        metavar="FILE.svg",
        help="draw the run, where the rig can; FILE.png needs the extra `plot`",
    )


def _add_model(verb: argparse.ArgumentParser) -> None:
    """Add what belongs to a model without a robot."""
    model = verb.add_argument_group(
        "a model alone", "in virtual time unless --clock says otherwise; 10 s unless --for does"
    )
    model.add_argument(
        "--events",
        type=Path,
        metavar="FILE.ev",
        help="feed the input ports of a board's model, or of MODEL, from this file",
    )
    model.add_argument(
        "--outputs", type=Path, metavar="FILE", help="write its outputs here, not to the screen"
    )
    model.add_argument(
        "--samples",
        type=partial(whole, least=2),
        metavar="N",
        help="instants shown of a quantized system (default 1001)",
    )


def _add_link(verb: argparse.ArgumentParser) -> None:
    """Add --role and --link."""
    verb.add_argument(
        "--role",
        metavar="NAME",
        help="run only the part of the model that plays this role by the board's [roles]; the "
        "rest runs in another process, at the other end of --link",
    )
    verb.add_argument(
        "--link",
        metavar="ADDRESS",
        help="the way to the other part: unix:PATH, udp:HOST:PORT[,listen=HOST:PORT][,key=FILE], "
        "or ros2[:key=FILE]",
    )


def choose_clock(arguments: argparse.Namespace) -> None:
    """Settle `--clock` where it was left out, and refuse what contradicts itself.

    Models alone run in virtual time, robots in real time. Raises ConfigError.
    """
    is_alone = arguments.events is not None or is_model(arguments.board)
    if arguments.clock is None:
        arguments.clock = "virtual" if is_alone else "monotonic"
    doubles = arguments.doubles or is_alone
    faults = clock_faults(arguments.clock, arguments.speed, doubles=doubles)
    if is_alone:
        faults += _not_for_a_model_alone(arguments)
    elif arguments.outputs or arguments.samples:
        faults.append("--outputs and --samples belong to a model alone; expected --events or MODEL")
    if faults:
        raise ConfigError("run", faults)


def _not_for_a_model_alone(arguments: argparse.Namespace) -> Iterator[str]:
    """The options that say something about hardware, or what arrives twice."""
    why = "a model alone has no hardware"
    if arguments.events is not None:
        why = "--events runs the model alone"
        if arguments.plot:
            yield "--events runs the model alone: leave --plot out"
        if arguments.inputs:
            yield "--input: an event file says what arrives when: leave it out"
    for option in _FOR_A_ROBOT:
        if getattr(arguments, option):
            yield f"{why}: leave --{option} out"


def clock_of(arguments: argparse.Namespace) -> Clock:
    """The clock chosen."""
    return options.clock_of(arguments.clock, arguments.speed)


def add_input_option(verb: argparse.ArgumentParser) -> None:
    """Add --input."""
    verb.add_argument(
        "--input",
        type=planned_input,
        action="append",
        default=[],
        metavar="SECONDS:PORT=VALUE",
        dest="inputs",
        help="put a value, JSON or the name of an enumeration's member, into an input port of the "
        "model at that second of the run; may be repeated",
    )


def planned_input(text: str) -> PlannedInput:
    """One word of the command line."""
    when, _, what = text.partition(":")
    port, _, value = what.partition("=")
    try:
        at_s = float(when)
    except ValueError:
        at_s = -1.0
    if not (isfinite(at_s) and 0 <= at_s <= 1e9 and port and value):
        expected = "expected SECONDS:PORT=VALUE, such as 2.5:target=1.0"
        raise argparse.ArgumentTypeError(f"{text!r}: {expected}")
    content = value.encode() if is_json(value) else json.encode(value)
    return PlannedInput(0 if at_s == 0 else seconds(at_s), port, content)
