"""A reader as `top` is one: `python -m benchmarks.reader.process FILE`, its commands are bytes.

`+` makes it read the statistics ten times a second, and make JSON of them; `-` makes it rest, and
print how often it did. It ends with its input.
"""

import os
import select
import sys
from pathlib import Path
from time import monotonic

from firmware_runtime.statistics.reader import read_statistics

READINGS_HZ = 10
READ, REST = b"+", b"-"
_INPUT = 0
"""Standard input, unbuffered: `select` must see what has not been taken."""


def main() -> None:
    """Obey until there is nothing more to obey."""
    path = Path(sys.argv[1])
    while os.read(_INPUT, 1) == READ:
        print(_read_until_stopped(path), flush=True)


def _read_until_stopped(path: Path) -> int:
    """Read at once, then at the rate until it is to rest; return how often."""
    readings, next_at, stopped = 0, monotonic(), False
    while not stopped:
        read_statistics(path).as_json()
        readings += 1
        next_at += 1 / READINGS_HZ
        stopped = bool(select.select([_INPUT], (), (), max(next_at - monotonic(), 0))[0])
    os.read(_INPUT, 1)
    return readings


if __name__ == "__main__":
    main()
