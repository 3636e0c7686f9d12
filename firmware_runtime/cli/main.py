"""The entry point: reads the command line, calls one verb, turns errors into sentences."""

import argparse
import os
import sys
from collections.abc import Sequence
from importlib.metadata import version

from firmware_runtime.cli import bench, boards, check, diagram, doubles, run, stats, tree
from firmware_runtime.cli.status import Status
from firmware_runtime.errors import BoardError, FirmwareRuntimeError
from firmware_runtime.hal.errors import HalError
from firmware_runtime.telemetry.errors import StatisticsFileError
from firmware_runtime.telemetry.trace_file import TraceFileError
from sim_doubles.served.errors import ServingError

_VERBS = (run, check, boards, tree, diagram, stats, bench, doubles)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit status."""
    parsed = parser().parse_args(arguments)
    try:
        status: int = parsed.execute(parsed)
    except (BoardError, ServingError, StatisticsFileError, TraceFileError) as error:
        return _refuse(error, Status.BAD_INPUT)
    except HalError as error:
        return _refuse(error, Status.NO_DEVICE)
    except FirmwareRuntimeError as error:
        return _refuse(error, Status.MODEL_ERROR)
    except BrokenPipeError:
        # Whoever read our output has gone; what is left in the buffer has nowhere to go either.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return Status.OK
    return status


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    top = argparse.ArgumentParser(
        prog="firmware-runtime",
        description="Run DEVS models as the firmware of a robot.",
        epilog="Exit status: 0 done, 1 a model failed, 2 bad input, 3 a bus or chip is missing, "
        "4 some output could not be switched off, 130 and 143 stopped by SIGINT and SIGTERM.",
    )
    top.add_argument(
        "--version", action="version", version=f"%(prog)s {version('firmware-runtime')}"
    )
    verbs = top.add_subparsers(required=True, metavar="COMMAND")
    for verb in _VERBS:
        verb.add_to(verbs)
    return top


def _refuse(error: FirmwareRuntimeError, status: Status) -> int:
    print(f"firmware-runtime: {error}", file=sys.stderr)
    return status
