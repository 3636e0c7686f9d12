"""Output that nobody reads any more, as that of `... | head`: no reason to fail, or to succeed."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TextIO


@contextmanager
def readers_may_go() -> Iterator[None]:
    """Within the block, printing ends early if whoever read it has gone; nothing else changes.

    What is printed afterwards, also when the interpreter ends, goes nowhere.
    """
    try:
        yield
        print(end="", flush=True)  # also where there is no standard output to flush
    except BrokenPipeError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for stream in filter(None, (sys.stdout, sys.stderr)):
            os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def tell(what: str, stream: TextIO) -> None:
    """Print a line for whoever reads it: that nobody does, or a full disk, is no reason to stop."""
    with suppress(OSError):
        print(what, file=stream, flush=True)
