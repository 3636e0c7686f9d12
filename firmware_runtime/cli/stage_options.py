"""`run --stage`: what it chooses, and which other options fit it."""

import argparse
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

from firmware_runtime.board.roles import Stage
from firmware_runtime.cli.chosen_model import is_model
from firmware_runtime.errors import ConfigError

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
    "arm": "its robot end is on doubles",
    "supervised": "its robot end is on doubles",
}
"""What fits a stage of one process only."""


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
