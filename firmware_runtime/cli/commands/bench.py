"""`firmware-runtime bench NAME`: measure the runtime beside its peers; code in `benchmarks`.

The benches are imported when one is called, so that a robot's start does not wait for them. They
belong to a checkout and are in no wheel.
"""

import argparse
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

from firmware_runtime.cli.arguments import SubParsers, add_verb
from firmware_runtime.errors import Status
from firmware_runtime.host.deployment.package_wheel import checkout

_BENCHES = (
    "timing",
    "peers",
    "devstone",
    "loop",
    "page",
    "reader",
    "recording",
    "keyframes",
    "replay",
    "prediction",
)


def add_to(verbs: SubParsers) -> None:
    """Add this verb to the command line."""
    verb = add_verb(verbs, "bench", "Measure the runtime beside its peers.", execute)
    verb.add_argument("bench", choices=_BENCHES, metavar="NAME", help=", ".join(_BENCHES))
    verb.add_argument(
        "options", nargs=argparse.REMAINDER, metavar="...", help="see `bench NAME --help`"
    )


def execute(arguments: argparse.Namespace) -> int:
    """Run the bench; return its exit status."""
    place = checkout()
    if place is None:
        print(
            f"firmware-runtime: bench {arguments.bench}: not installed with the program; expected "
            "to run from a checkout of the project, which has the folder benchmarks",
            file=sys.stderr,
        )
        return Status.BAD_INPUT
    bench = _bench(place, arguments.bench)
    parser = argparse.ArgumentParser(
        prog=f"firmware-runtime bench {arguments.bench}", description=bench.SUMMARY
    )
    import_module("benchmarks.shared.results").add_common_options(parser)
    bench.add_options(parser)
    try:
        status: int = bench.execute(parser.parse_args(arguments.options))
    except OSError as error:
        print(f"firmware-runtime: bench {arguments.bench}: {error}", file=sys.stderr)
        return Status.BAD_INPUT
    return status


def _bench(place: Path, name: str) -> ModuleType:
    if str(place) not in sys.path:  # an editable installation knows only what is in a wheel
        sys.path.append(str(place))
    return import_module(f"benchmarks.{name}.bench")
