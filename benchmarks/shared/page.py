"""The page of a run, served by a process of its own."""

import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

from benchmarks.shared.process import COMMAND, LoopError


@contextmanager
def served(*words: object) -> Iterator[str]:
    """`view` with these words on any free port; yields its address. Raises LoopError."""
    command = [*COMMAND, "view", *map(str, words), "--port", "0", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None  # noqa: S101 -- a pipe was asked for
            found = re.search(r"http://[^/\s]+", process.stdout.readline())
            if found is None:
                raise LoopError("view: no address; expected it to serve a page")
            yield found[0]
        finally:
            process.kill()
