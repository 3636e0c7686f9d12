"""`firmware-runtime replay RUN [BOARD]`: run again what entered, and compare."""

import argparse
from pathlib import Path

from firmware_runtime.cli.arguments import (
    SubParsers,
    add_output,
    add_recorded,
    add_set,
    add_verb,
    second,
    speed,
)
from firmware_runtime.devs.time import NEVER
from firmware_runtime.errors import ConfigError
from firmware_runtime.recording.blackbox.locations import find_recording

_ABOUT = """
Every run leaves a recording of what entered it: bytes of its buses and ports, external events, the
clock. RUN is the file of one, or a board's name for its last run, also of one that was killed. The
same drivers and models run again on it, as fast as they can; every value that leaves a port, every
transfer and the counts of activations are compared with the run's, floats to the bit.
Exit status 0: all are equal; 1: some differ, or the recording is not whole; 12: none differs, but
some could not be compared. With BOARD, --set or
--with it is a question, not a verdict: what other settings or code would have said to what entered,
every output's difference as numbers; status 0.
"""


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    summary = "Run a recorded run again; compare everything that left its models."
    verb = add_verb(verbs, "replay", summary, execute)
    verb.epilog = _ABOUT
    add_recorded(verb)
    verb.add_argument(
        "board",
        metavar="BOARD",
        nargs="?",
        help="replay by this board's settings; default: those that the recording holds",
    )
    add_set(verb, "what if this number had been another")
    verb.add_argument(
        "--from",
        type=second,
        default=0,
        metavar="T",
        dest="begin",
        help="from the keyframe before this second of the run",
    )
    verb.add_argument(
        "--until", type=second, default=NEVER, metavar="T", help="to this second of the run"
    )
    verb.add_argument(
        "--speed",
        type=speed,
        metavar="N",
        help="so many times real time; default: as fast as it goes",
    )
    verb.add_argument("--json", action="store_true", help="print the comparison as JSON")
    _add_what_if(verb)


def _add_what_if(verb: argparse.ArgumentParser) -> None:
    """Add what asks for other code, and what is done with the answer."""
    verb.add_argument(
        "--with",
        type=Path,
        metavar="CHECKOUT",
        dest="checkout",
        help="what would the code in this folder have said? In a process of its own",
    )
    add_output(
        verb,
        "of what BOARD, --set or --with change: plots of the outputs that differ most",
        metavar="FILE.html|.svg|.png",
    )
    verb.add_argument(
        "--watch",
        action="store_true",
        help="run it again whenever a file of the robot's packages, or of CHECKOUT, is saved",
    )
    verb.add_argument(
        "--as-test",
        type=Path,
        metavar="FILE.py",
        help="write a pytest test of the shortest piece that shows a difference, or of --from to "
        "--until, with its recording beside it",
    )


def execute(arguments: argparse.Namespace) -> int:
    """Replay a run: what it was, or what it would have been."""
    path = find_recording(arguments.run)
    if arguments.as_test is not None:
        from firmware_runtime.cli.replayed_run import as_test  # noqa: PLC0415 -- of this answer only

        return as_test(arguments, path)
    is_changed = bool(arguments.checkout or arguments.assignments or arguments.board)
    if is_changed or arguments.watch:
        from firmware_runtime.cli.what_if import what_if_run  # noqa: PLC0415 -- of this answer only

        return what_if_run(arguments, path)
    if arguments.output is not None:
        fault = f"-o {arguments.output}: nothing is changed; expected --set, --with or a board"
        raise ConfigError.of_one("replay", fault)
    from firmware_runtime.cli.replayed_run import replay_run  # noqa: PLC0415 -- of this answer only

    return replay_run(arguments, path)
