"""One end of a stage as a process of its own: started, listened to, and ended in order.

It is `firmware-runtime run BOARD --role ...`, as a person would start it, in a process group of its
own: a Ctrl-C is for the process that started it, which hands signals on. It ends by itself when
that one has gone.
"""

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from firmware_runtime.errors import Status

_LONGEST_REPORT = 1 << 16
_LONGEST_WORDS = 1 << 14


class EndProcess:
    """A run of one role; `before` are words to put before the command, such as nsenter's.

    `report` is the newest that it sent, `said` what it printed to standard error, by lines.
    """

    def __init__(self, role: str, words: Sequence[str], before: Sequence[str] = ()) -> None:
        self.role = role
        self.report: dict[str, Any] = {}
        self.was_asked_to_end = False
        self._rest = b""
        self._output = tempfile.TemporaryFile()  # noqa: SIM115 -- closed with the process
        self.reports, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.reports.setblocking(False)
        errors, write_errors = os.pipe2(os.O_CLOEXEC)
        os.set_blocking(errors, False)
        self.errors = errors
        command = [*before, sys.executable, "-m", "firmware_runtime.cli", *words]
        with theirs:
            self._process = subprocess.Popen(  # noqa: S603 -- this program itself
                [*command, "--json", "--report-to", str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=write_errors,
                pass_fds=[theirs.fileno()],
                process_group=0,
            )
        os.close(write_errors)
        self.ended = os.pidfd_open(self._process.pid)

    @property
    def status(self) -> int | None:
        """Its exit status, 128 and more for a signal's; None while it runs."""
        status = self._process.poll()
        return status if status is None or status >= 0 else 128 - status

    @property
    def has_failed(self) -> bool:
        """Whether it ended otherwise than at its time or because it was asked to."""
        expected = {int(Status.OK)}
        if self.was_asked_to_end:
            expected |= {int(Status.TERMINATED), int(Status.INTERRUPTED)}
        return self.status not in expected

    def receive_reports(self) -> None:
        """Keep the newest report."""
        with suppress(BlockingIOError, ConnectionError):
            while packet := self.reports.recv(_LONGEST_REPORT):
                self.report = json.loads(packet)

    def sentences(self) -> list[str]:
        """What it has printed to standard error since the last call, whole lines."""
        with suppress(BlockingIOError):
            while words := os.read(self.errors, _LONGEST_WORDS):
                self._rest += words
        *lines, self._rest = self._rest.split(b"\n")
        return [line.decode(errors="replace") for line in lines]

    def ask_to_end(self, number: signal.Signals = signal.SIGTERM) -> None:
        """Let it switch its outputs off and end."""
        if self._process.poll() is None:
            self.was_asked_to_end = True
            self._process.send_signal(number)

    def kill(self) -> None:
        """End it at once; its outputs are left as they are."""
        self._process.kill()

    def document(self) -> dict[str, Any]:
        """What it printed as JSON once it ended; empty if it got so far as to print none."""
        self._output.seek(0)
        with suppress(ValueError):
            found = json.loads(self._output.read())
            if isinstance(found, dict):
                return found
        return {}

    def close(self) -> None:
        """End it, if it still runs, and release what it was listened to by."""
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait()
        self.reports.close()
        self._output.close()
        os.close(self.errors)
        os.close(self.ended)
