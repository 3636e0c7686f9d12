"""Stops the process behind a descriptor for a moment: a program of its own.

The process that started it may die meanwhile; this one goes on all the same, unless this program is
killed (SIGKILL) as well.
"""

import os
import signal
import sys
import time


def main(descriptor: int, span_s: float) -> None:
    """Stop it, and let it go on."""
    for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    signal.pidfd_send_signal(descriptor, signal.SIGSTOP)
    try:
        time.sleep(span_s)
    finally:
        signal.pidfd_send_signal(descriptor, signal.SIGCONT)
        os.close(descriptor)


if __name__ == "__main__":
    main(int(sys.argv[1]), float(sys.argv[2]))
