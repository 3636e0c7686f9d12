"""Verbs that make a table of many runs: how they are carried out, progress, and an early end."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import Final

from firmware_runtime.lab.sweeps.partial import partial_of
from firmware_runtime.system.signals import exit_on_signals
from firmware_runtime.system.terminal import Progress, print_line

_EVERY_S: Final = 1.0
_RATED_AFTER_S: Final = 1.0
"""Rows may come two at a time."""


def add_how(verb: argparse.ArgumentParser, what: str) -> None:
    """Add --workers, --scheduler and --resume of a verb that makes `what`."""
    verb.add_argument(
        "--workers", type=int, metavar="N", help="processes; default: one for each core"
    )
    verb.add_argument(
        "--scheduler", metavar="ADDRESS", help="run on a cluster, by Dask's scheduler there"
    )
    verb.add_argument(
        "--resume",
        action="store_true",
        help=f"go on with a {what} that was interrupted; begin where there is none",
    )


@contextmanager
def interruptible(output: Path | None) -> Iterator[None]:
    """Within the block a signal ends the verb, which says what is kept of its table."""
    try:
        with exit_on_signals():
            yield
    except SystemExit:
        if output is not None and (kept := partial_of(output)).exists():
            said = f"{kept} has the finished rows; the same command with --resume goes on"
            print_line(f"firmware-runtime: {said}", sys.stderr)
        raise


class RowProgress:
    """How far it is, on standard error: over and over on a terminal, once a tenth elsewhere."""

    def __init__(self, failed: str = "failed") -> None:
        """`failed` is the word for rows that are not as they should be."""
        self._word = failed
        self._shown = Progress(sys.stderr, every_s=_EVERY_S / 4)
        self._first: tuple[float, int] | None = None
        """When the first rows were there, and how many: what comes before them is no row."""
        self._said = 0

    def __call__(self, done: int, size: int, failed: int) -> None:
        """So many rows are there."""
        now = monotonic()
        began, before = self._first = self._first or (now, done)
        rate = (done - before) / (now - began) if now - began > _RATED_AFTER_S else 0.0
        is_due = done == size or 10 * (done - self._said) >= size
        if is_due:
            self._said = done
        self.say(self._line(done, size, failed, rate), is_due=is_due)

    def say(self, line: str, *, is_due: bool = True) -> None:
        """Show a line; where nothing is shown over and over, only one that `is_due`."""
        self._shown.show(line)
        if is_due and not self._shown.is_shown:
            print_line(line, sys.stderr)

    def close(self) -> None:
        """Take the line away."""
        self._shown.close()

    def _line(self, done: int, size: int, failed: int, rate: float) -> str:
        words = [f"{done} of {size} runs"]
        if failed:
            words.append(f"{failed} {self._word}")
        if rate:
            words += [f"{rate:.1f} a second", f"{(size - done) / rate:.0f} s left"]
        return ", ".join(words)
