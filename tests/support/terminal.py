"""A command at a terminal of its own, which a test reads, or leaves unread."""

import os
import pty
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from select import select

from tests.support.waiting import PATIENCE_S

_BEGIN = """
import os, sys
os.close(os.open(os.ttyname(0), os.O_RDWR))  # a new session's first terminal becomes its own
os.execv(sys.argv[1], sys.argv[1:])
"""


@contextmanager
def terminal_of(*words: str, keep: int = -1) -> Iterator[tuple["subprocess.Popen[bytes]", int]]:
    """A program at a terminal, and the end of it that a person would look at."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", _BEGIN, *words],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        start_new_session=True,
        pass_fds=() if keep < 0 else (keep,),
    )
    os.close(theirs)
    try:
        yield process, ours
    finally:
        process.kill()
        process.wait(PATIENCE_S)
        os.close(ours)


def at_a_terminal(*words: str, status: int = 0) -> str:
    """What a program prints at a terminal, up to its end, which is to have this status."""
    shown = b""
    with terminal_of(*words) as (process, ours):
        with suppress(OSError):  # what reading says once the other end is closed
            while select([ours], (), (), PATIENCE_S)[0]:
                if not (piece := os.read(ours, 4096)):
                    break
                shown += piece
        assert process.wait(PATIENCE_S) == status, shown.decode(errors="replace")
    return shown.decode(errors="replace")
