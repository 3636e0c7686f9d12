"""The page of a run, served by a process of its own."""

import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from signal import SIGINT
from typing import Any, NamedTuple

from benchmarks.shared.process import COMMAND, LoopError
from firmware_runtime.system.programs import end_within

_ENDS_WITHIN_S = 60.0


class Served(NamedTuple):
    """Where a page is, and the process that was started for it."""

    address: str
    process: "subprocess.Popen[str]"


@contextmanager
def served(
    verb: str,
    *words: object,
    **options: Any,  # noqa: ANN401 -- of Popen
) -> Iterator[Served]:
    """`view` or `play` with these words, on any free port, until the block ends by Ctrl-C.

    Raises LoopError if it serves no page.
    """
    command = [*COMMAND, verb, *map(str, words), "--port", "0", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **options) as process:
        try:
            assert process.stdout is not None  # noqa: S101 -- a pipe was asked for
            found = (re.search(r"http://[^/\s]+", line) for line in process.stdout)
            address = next((each[0] for each in found if each is not None), None)
            if address is None:
                raise LoopError(f"{verb}: no address; expected it to serve a page")
            yield Served(address, process)
        finally:
            process.send_signal(SIGINT)
            end_within(process, _ENDS_WITHIN_S)
