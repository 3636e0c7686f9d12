"""The clock that the command line asks for."""

import argparse
from collections.abc import Iterator

from firmware_runtime.errors import ConfigError
from firmware_runtime.executive.clocks import Clock
from firmware_runtime.runs import options as choices
from firmware_runtime.runs.options import clock_faults


def choose_clock(arguments: argparse.Namespace) -> None:
    """Settle `--clock` where it was left out, and refuse what contradicts itself.

    Event files run in virtual time, robots in real time. Raises ConfigError.
    """
    if arguments.clock is None:
        arguments.clock = "monotonic" if arguments.events is None else "virtual"
    doubles = arguments.doubles or arguments.events is not None
    faults = clock_faults(arguments.clock, arguments.speed, doubles=doubles)
    if arguments.events is not None:
        faults += _not_for_a_model_alone(arguments)
    if arguments.events is None and (arguments.outputs or arguments.model or arguments.until):
        faults.append("--outputs, --model and --until belong to --events")
    if faults:
        raise ConfigError("run", faults)


def _not_for_a_model_alone(arguments: argparse.Namespace) -> Iterator[str]:
    """The options that say something about hardware, or the end twice."""
    for option in ("doubles", "plot", "arm", "supervised", "record"):
        if getattr(arguments, option):
            yield f"--events runs the model alone: leave --{option} out"
    if arguments.inputs:
        yield "--input: an event file says what arrives when: leave it out"
    if arguments.until is not None and arguments.duration_s is not None:
        yield "--until and --for both say when the run ends: leave one out"


def clock_of(arguments: argparse.Namespace) -> Clock:
    """The clock chosen."""
    return choices.clock_of(arguments.clock, arguments.speed)
