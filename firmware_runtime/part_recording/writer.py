"""The process that writes a recording: it copies what comes to its input into a file.

The run hands over a pipe and the open file, so that no disk ever holds up its loop, and the file
holds all that the run sent, however the run ended. A file that takes no more ends the copy with
status 1. The program needs nothing but the standard library, so its start takes little.
"""

import os
import signal
import sys

PIECE = 1 << 16


def copy(source: int, file: int) -> int:
    """Copy until the other end is closed; return the exit status."""
    while piece := os.read(source, PIECE):
        left = memoryview(piece)
        while left:
            try:
                left = left[os.write(file, left) :]
            except OSError as error:
                sys.stderr.write(error.strerror or type(error).__name__)
                return 1
    return 0


if __name__ == "__main__":
    # The run's end is this one's, whatever signal the run is ended by.
    for each in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(each, signal.SIG_IGN)
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))  # a run may come before others
    sys.exit(copy(0, 1))
