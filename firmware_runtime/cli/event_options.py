"""The options of `run BOARD --events FILE`; what carries it out is loaded where they are given."""

import argparse
from pathlib import Path

from firmware_runtime.cli.arguments import instant


def add_event_options(verb: argparse.ArgumentParser) -> None:
    """Add what belongs to event files."""
    events = verb.add_argument_group(
        "event files", "the model alone, in virtual time unless --clock says otherwise"
    )
    events.add_argument(
        "--events",
        type=Path,
        metavar="FILE.ev",
        help="feed the model's input ports from this file; no hardware is built",
    )
    events.add_argument(
        "--outputs", type=Path, metavar="FILE.out", help="write its outputs here, not to the screen"
    )
    events.add_argument(
        "--until",
        type=instant,
        metavar="HH:MM:SS:mmm",
        help="run up to this instant, as --for does in seconds; default 10 s after the last event",
    )
    events.add_argument(
        "--model", type=Path, metavar="FILE.ma", help="run on the model that this file describes"
    )
