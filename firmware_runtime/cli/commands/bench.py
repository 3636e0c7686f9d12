"""`firmware-runtime bench NAME`: measure the runtime beside its peers; code in `benchmarks`.

The benches are imported when one is asked for, so that a robot's start does not wait for them.
"""

import argparse
import sys
from importlib import import_module

from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.status import Status

_BENCHES = ("timing", "peers", "devstone", "accounting", "loop", "reader")


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    verb = add_verb(verbs, "bench", "Measure the runtime beside its peers.", execute)
    verb.add_argument("bench", choices=_BENCHES, metavar="NAME", help=", ".join(_BENCHES))
    verb.add_argument(
        "options", nargs=argparse.REMAINDER, metavar="...", help="see `bench NAME --help`"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run the bench; return its exit status."""
    bench = import_module(f"benchmarks.{arguments.bench}")
    parser = argparse.ArgumentParser(
        prog=f"firmware-runtime bench {arguments.bench}", description=bench.SUMMARY
    )
    bench.add_options(parser)
    try:
        status: int = bench.execute(parser.parse_args(arguments.options))
    except OSError as error:
        print(f"firmware-runtime: bench {arguments.bench}: {error}", file=sys.stderr)
        return Status.BAD_INPUT
    return status
