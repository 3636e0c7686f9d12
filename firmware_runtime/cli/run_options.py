"""The options of `firmware-runtime run`, by kind; the clock and the stage that they ask for."""

import argparse
from collections.abc import Iterator
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_runtime.board.roles import Stage
from firmware_runtime.cli.arguments import add_duration, add_statistics, positive, speed, whole
from firmware_runtime.cli.chosen_board import is_model
from firmware_runtime.devs.time import LONGEST_S, seconds
from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.runs import options
from firmware_runtime.runs.options import clock_faults

if TYPE_CHECKING:
    from firmware_runtime.hal.strike import Strike
    from firmware_runtime.runs.planned_inputs import PlannedInput

_LOOP_S = 0.01
_FOR_A_ROBOT = ("doubles", "fault", "arm", "supervised", "record", "role", "link", "loop")
"""Options that say something about hardware, or about a robot's two ends."""
_OF_ANY_STAGE = {
    "clock": "a stage has its clock",
    "speed": "a stage has its clock",
    "events": "event files run the model alone",
    "outputs": "event files run the model alone",
    "role": "a stage has all roles",
}
"""What fits no stage, and why."""
_ONE_PROCESS = {
    "statistics": "each end keeps its own, as BOARD and BOARD.ROLE",
    "plot": "its robot end is another process",
    "fault": "its robot end is another process",
    "arm": "its robot end is on doubles",
    "supervised": "its robot end is on doubles",
}
"""What fits a stage of one process only."""


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
        "--fault",
        type=stated_fault,
        action="append",
        default=[],
        metavar="SECONDS:KIND[=AMOUNT][:DEVICE[:SECONDS]]",
        help="break something on doubles that are made for this run, at that second of it, for so "
        "long or to its end, such as 2.0:freeze:imu:1.0; kinds as of `doubles fault`; may be "
        "repeated",
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
        metavar="FILE.html",
        help="draw the run, where the rig can, as a page, or its data as FILE.json; a picture, "
        "FILE.svg or FILE.png, needs the extra `plot`",
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


def planned_input(text: str) -> "PlannedInput":
    """One word of the command line."""
    # a run without one starts without what one takes
    from msgspec import json  # noqa: PLC0415

    from firmware_runtime.runs.planned_inputs import PlannedInput  # noqa: PLC0415
    from firmware_runtime.statistics.json_values import is_json  # noqa: PLC0415

    when, _, what = text.partition(":")
    port, _, value = what.partition("=")
    try:
        at_s = float(when)
    except ValueError:
        at_s = -1.0
    if not (0 <= at_s <= LONGEST_S and port and value):
        expected = "expected SECONDS:PORT=VALUE, such as 2.5:target=1.0"
        raise argparse.ArgumentTypeError(f"{text!r}: {expected}")
    content = value.encode() if is_json(value) else json.encode(value)
    return PlannedInput(0 if at_s == 0 else seconds(at_s), port, content)


def stated_fault(text: str) -> "Strike":
    """One word of the command line."""
    from firmware_runtime.hal.strike import Strike  # noqa: PLC0415 -- of few runs

    when, kind, device, span = [*text.split(":", 3), "", "", ""][:4]
    name, equals, amount = kind.partition("=")
    try:
        strike = Strike(
            name,
            device,
            float(when),
            float(span) if span else None,
            float(amount) if equals else None,
        )
    except ValueError:
        expected = "expected SECONDS:KIND[=AMOUNT][:DEVICE[:SECONDS]], such as 2.0:freeze:imu:1.0"
        raise argparse.ArgumentTypeError(f"{text!r}: {expected}") from None
    if (fault := strike.fault()) is not None:
        raise argparse.ArgumentTypeError(f"{text!r}: {fault}")
    return strike


def add_stage_options(verb: argparse.ArgumentParser) -> None:
    """Add --stage and what belongs to it."""
    stages = verb.add_argument_group(
        "stages", "one command for controller and robot, wherever they are"
    )
    stages.add_argument(
        "--stage",
        choices=[str(stage) for stage in Stage],
        metavar="STAGE",
        help="simulation: virtual time on doubles; network: controller and robot end, on doubles, "
        "are two processes; remote: the robot end is elsewhere, or behind a bad network of this "
        "machine; embedded: one process in real time, on chips or --doubles",
    )
    stages.add_argument(
        "--peer",
        metavar="HOST:PORT",
        help="stage remote: where `run BOARD --role robot` listens on the other machine",
    )
    stages.add_argument(
        "--key", type=Path, metavar="FILE", help="with --peer: the key that both ends have"
    )
    stages.add_argument(
        "--impair",
        metavar="HOW",
        help="stage remote without --peer: delay=40ms,jitter=10ms,loss=2%%,reorder=1%%,"
        "duplicate=1%%,seed=1, each way; the first three are the default",
    )


def choose_stage(arguments: argparse.Namespace) -> None:
    """Refuse what does not fit the stage, and settle what it decides. Raises ConfigError."""
    stage = arguments.stage = None if arguments.stage is None else Stage(arguments.stage)
    faults = list(_faults(arguments, stage))
    if faults:
        raise ConfigError("run", faults)
    if stage is Stage.SIMULATION:
        arguments.doubles, arguments.clock = True, "virtual"


def _faults(arguments: argparse.Namespace, stage: Stage | None) -> Iterator[str]:
    if arguments.loop is not None and arguments.role is None:
        yield "--loop belongs to --role: one end sends the ramp, the other sends it back"
    if stage is None:
        for option in ("peer", "key", "impair"):
            if getattr(arguments, option) is not None:
                yield f"--{option} belongs to --stage remote"
        return
    if is_model(arguments.board):
        yield f"--stage {stage}: a model alone has no two ends; leave --stage out"
    yield from _do_not_fit(arguments, stage, _OF_ANY_STAGE)
    if stage.has_two_ends:
        yield from _do_not_fit(arguments, stage, _ONE_PROCESS)
    if stage is Stage.SIMULATION:
        yield from _do_not_fit(arguments, stage, {"arm": "its time is virtual"})
    if stage is not Stage.EMBEDDED and isinstance(arguments.doubles, Path):
        yield f"--stage {stage} makes its own doubles: leave --doubles {arguments.doubles} out"
    yield from _link_faults(arguments.link, stage)
    yield from _remote_faults(arguments, stage)


def _link_faults(link: str | None, stage: Stage) -> Iterator[str]:
    if link is None:
        return
    if not stage.has_two_ends:
        yield f"--stage {stage} is one process: leave --link out"
    elif stage is Stage.REMOTE and link != "udp":
        yield f"--stage remote goes over UDP: leave --link {link} out"
    elif link not in {"udp", "ros2"}:
        yield f"--link {link}: a stage chooses the addresses; expected udp or ros2"


def _do_not_fit(
    arguments: argparse.Namespace, stage: Stage, options: dict[str, str]
) -> Iterator[str]:
    for option, why in options.items():
        if getattr(arguments, option):
            yield f"--stage {stage}: leave --{option} out; {why}"


def _remote_faults(arguments: argparse.Namespace, stage: Stage) -> Iterator[str]:
    if stage is not Stage.REMOTE:
        for option in ("peer", "key", "impair"):
            if getattr(arguments, option) is not None:
                yield f"--{option} belongs to --stage remote"
        return
    if arguments.peer is not None:
        yield from _peer_faults(arguments)
    elif arguments.key is not None:
        yield "--key belongs to --peer: a stand-in on this machine makes its own"
    if arguments.impair is not None:
        try:
            _read_impairment(arguments.impair)
        except ConfigError as error:
            yield from (f"--impair: {fault}" for fault in error.faults)


def _peer_faults(arguments: argparse.Namespace) -> Iterator[str]:
    """The robot end is on another machine."""
    if arguments.key is None:
        yield "--peer: without a key anything there could drive the robot; expected --key FILE"
    if arguments.impair is not None:
        yield "--impair is for a stand-in on this machine: leave it out where there is a --peer"
    if arguments.doubles:
        yield "--peer: the robot end decides whether it is on doubles; leave --doubles out"


def _read_impairment(text: str) -> None:
    """Raise ConfigError for what is no impairment; what reads it is imported where there is one."""
    import_module("firmware_runtime.links.cut.impaired_path").impairment(text)
