"""The options of `firmware-runtime run`, by kind."""

import argparse
from pathlib import Path

from firmware_runtime.cli.arguments import add_duration, add_statistics, positive, speed
from firmware_runtime.lab.experiments.loop_model import PERIOD_S


def add_run_options(verb: argparse.ArgumentParser) -> None:
    """Add them, but for those of stages, inputs and event files."""
    _add_choices(verb)
    _add_link(verb)
    _add_files(verb)
    verb.add_argument("--json", action="store_true", help="print result and statistics as JSON")
    verb.add_argument(
        "--loop",
        type=positive,
        nargs="?",
        const=PERIOD_S,
        metavar="SECONDS",
        help="with --role: in place of the board's model a ramp, a value every so often (default "
        f"{PERIOD_S:g}), that is sent out and back, as the ends of `experiment loop-delay` do",
    )
    for by_a_stage in ("--report-to", "--called-at"):
        verb.add_argument(by_a_stage, type=int, help=argparse.SUPPRESS)


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
        choices=("monotonic", "virtual", "scaled"),
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
