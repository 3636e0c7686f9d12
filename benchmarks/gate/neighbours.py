"""Processes that keep a machine busy: every other one computes, every other one moves memory."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_COMPUTES = "n = 0\nwhile True:\n    n = (n * 31 + 7) % 1000003"
_MOVES_MEMORY = "a = bytearray(32 << 20)\nwhile True:\n    b = bytes(a)"


@contextmanager
def busy_neighbours(count: int) -> Iterator[None]:
    """So many of them within the block."""
    programs = [(_COMPUTES, _MOVES_MEMORY)[number % 2] for number in range(count)]
    running = [subprocess.Popen([sys.executable, "-S", "-c", each]) for each in programs]
    try:
        yield
    finally:
        for process in running:
            process.kill()
            process.wait()
