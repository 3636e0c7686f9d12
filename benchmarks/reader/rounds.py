"""One run of TachoBot, with a reader now and then: rounds of three segments of the same length.

Two segments of a round are alone, one has the reader; their order changes from round to round. What
the lateness of a segment was is the difference of two readings of the histogram, made by this
process at its ends, in all three alike. The reader is always there; alone, it rests.
"""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import sleep
from typing import TypeAlias

from benchmarks.loop.rates import STEADY_NS, assignments
from benchmarks.reader import process as reader_process
from benchmarks.shared.process import LoopError, tachobot
from benchmarks.shared.side_by_side import PROJECT, turned
from firmware_runtime.statistics.comparison import difference
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.layout import ELAPSED
from firmware_runtime.statistics.reader import read_statistics

ALONE, ALONE_AGAIN, READ = "alone", "alone again", "read"
KINDS = (ALONE, READ, ALONE_AGAIN)
_MARGIN_S = 30.0
"""What the run is longer than its segments; it does not see its end."""

Round: TypeAlias = dict[str, Histogram]
"""The lateness of each segment, by kind."""


class Reader:
    """The reading process; `reading` makes it read for a block, and counts."""

    def __init__(self, process: "subprocess.Popen[bytes]") -> None:
        self.readings = 0
        self._process = process

    @contextmanager
    def reading(self) -> Iterator[None]:
        """Within the block, it reads. Raises LoopError when it did not."""
        self._say(reader_process.READ)
        yield
        self._say(reader_process.REST)
        assert self._process.stdout is not None  # noqa: S101 -- a pipe was asked for
        answer = self._process.stdout.readline()
        if not answer:
            raise LoopError("reader: it has ended; expected it to say how often it has read")
        self.readings += int(answer)

    def _say(self, word: bytes) -> None:
        assert self._process.stdin is not None  # noqa: S101 -- a pipe was asked for
        self._process.stdin.write(word)


@contextmanager
def reader(statistics: Path, module: str) -> Iterator[Reader]:
    """A process of that module that reads these statistics, or what lies beside, on request."""
    command = [sys.executable, "-m", f"benchmarks.reader.{module}", str(statistics)]
    with subprocess.Popen(
        command,
        cwd=PROJECT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        bufsize=0,
    ) as process:
        try:
            yield Reader(process)
        finally:
            process.kill()


def rounds(
    directory: Path, rate_hz: int, count: int, segment_s: float, module: str
) -> tuple[list[Round], int]:
    """So many rounds at one rate, and how often the reader has read. Raises LoopError."""
    run_s = count * len(KINDS) * segment_s + _MARGIN_S
    with tachobot(directory, run_s, assignments(rate_hz)) as running:
        running.read_when(lambda statistics: statistics.cells[ELAPSED] >= STEADY_NS)
        with reader(running.statistics, module) as other:
            with other.reading():  # once, to be sure that it has started
                sleep(2 / reader_process.READINGS_HZ)
            other.readings = 0
            found = [
                {
                    kind: _segment(running.statistics, other, kind, segment_s)
                    for kind in turned(KINDS, number)
                }
                for number in range(count)
            ]
            return found, other.readings


def _segment(statistics: Path, other: Reader, kind: str, segment_s: float) -> Histogram:
    before = read_statistics(statistics)
    if kind == READ:
        with other.reading():
            sleep(segment_s)
    else:
        sleep(segment_s)
    return difference(read_statistics(statistics), before).lateness()
