"""Garbage collection of a command's own process: none while it loads, none of what it has loaded.

What a start makes stays to the end. Collections would walk through all of it, again and again while
it grows and once more when the interpreter ends: a third of the processor time of a short command.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext


class _Process:
    """Process of a command; `has_start` once the start of one that is its own is exempt."""

    has_start = False


@contextmanager
def no_collection_of_the_start() -> Iterator[None]:
    """Within the block nothing is collected; what is there at its end never is."""
    _Process.has_start = True
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


@contextmanager
def no_collection_of_what_a_verb_loads() -> Iterator[None]:
    """The same for what a verb goes on to load; only where the start is exempt, in our own process.

    A program that calls the command line in its own process keeps its collections as they are.
    """
    with no_collection_of_the_start() if _Process.has_start else nullcontext():
        yield


@contextmanager
def no_collection_at_the_end() -> Iterator[None]:
    """After the block, the interpreter ends without looking for cycles; what is held is released.

    Whatever must be written or closed is so by then: files are closed by those that open them.
    """
    try:
        yield
    finally:
        gc.freeze()
