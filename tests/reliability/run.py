"""`make campaign`: each part of what finds faults, as long as it is given time for.

    python -m tests.reliability.run mutants --count 300 --minutes 30 --save

`--save` keeps the result in benchmarks/results/reliability, from which docs/reliability.md is made
(tests/reliability/document.py). Exit status 1: something is not as it should be.
"""

import argparse
import sys
import time
from importlib import import_module
from typing import Final

from tests.reliability.results import BUILD, keep

PARTS: Final = (
    "mutants",
    "fuzzing",
    "dying",
    "soak",
    "campaigns",
    "planted",
    "networks",
    "machines",
)


def main() -> int:
    """Run one part, and say what came of it."""
    parser = argparse.ArgumentParser(prog="python -m tests.reliability.run", description=__doc__)
    parts = parser.add_subparsers(dest="part", required=True)
    for name in PARTS:
        module = import_module(f"tests.reliability.{name}")
        part = parts.add_parser(name, help=(module.__doc__ or "").partition("\n")[0])
        part.add_argument("--save", action="store_true", help="keep the result for the document")
        part.set_defaults(execute=module.execute)
        module.add_options(part)
    arguments = parser.parse_args()
    BUILD.mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    result = arguments.execute(arguments)
    took_s = time.monotonic() - began
    sys.stdout.write(f"{result.name}: {result.summary}, in {took_s:.0f} s\n")
    if arguments.save:
        sys.stdout.write(f"kept as {keep(result, took_s)}\n")
    return 0 if result.is_sound else 1


if __name__ == "__main__":
    sys.exit(main())
