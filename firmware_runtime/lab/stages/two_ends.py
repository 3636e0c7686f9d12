"""The ends of a stage together: all run, or none; whatever ends one of them ends the other.

    an end has failed         the others are asked to end, with their outputs off
    an end has ended          so are they, unless their link ends them first
    a signal                  is handed on to every end
    an end that does not end  is killed when its timeout is over, and said so

`ended` keeps the order, so the one that failed first gives the stage its exit status.
"""

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from selectors import EVENT_READ, DefaultSelector
from time import monotonic_ns
from typing import Any, Final

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.errors import Status
from firmware_runtime.system.signals import UntilSignal, signal_name
from firmware_runtime.system.this_system import IS_LINUX

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
        # without packets an end does not learn that this process has gone, and runs its time out
        kind = socket.SOCK_SEQPACKET if IS_LINUX else socket.SOCK_DGRAM
        self.reports, theirs = socket.socketpair(socket.AF_UNIX, kind)
        self.reports.setblocking(False)
        errors, write_errors = os.pipe()
        os.set_blocking(errors, False)
        self.errors = errors
        self.ended, held = os.pipe()  # it holds the other end as long as it lives
        command = [*before, sys.executable, "-m", "firmware_runtime.cli", *words]
        with theirs:
            self._process = subprocess.Popen(  # noqa: S603 -- this program itself
                [*command, "--json", "--report-to", str(theirs.fileno())],
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=write_errors,
                pass_fds=[theirs.fileno(), held],
                process_group=0,
            )
        os.close(write_errors)
        os.close(held)

    @property
    def status(self) -> int | None:
        """Its exit status, 128 and more for a signal's; None while it runs."""
        status = self._process.poll()
        return status if status is None or status >= 0 else 128 - status

    @property
    def has_failed(self) -> bool:
        """Return whether it ended otherwise than at its time or because it was asked to."""
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
        """Return what it has printed to standard error since the last call, whole lines."""
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

    def wait(self) -> None:
        """Wait until its status is known: it has let go of all that is its."""
        self._process.wait()

    def kill(self) -> None:
        """End it at once; its outputs are left as they are."""
        self._process.kill()

    def document(self) -> dict[str, Any]:
        """Return what it printed as JSON once it ended; empty if it printed none."""
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


TIMEOUT: Final = 30 * SECOND
"""Ns that an end may take to switch its outputs off and to report."""
BY_ITSELF: Final = SECOND
"""Ns that an end has to end by itself once another one has ended well."""
SHOW_EVERY: Final = 250 * MILLISECOND


class TwoEnds:
    """Processes that live and end together; `say` prints a sentence, `show` how all fare."""

    def __init__(
        self, signalled: UntilSignal, say: Callable[[str], None], show: Callable[[], None]
    ) -> None:
        self.ends: list[EndProcess] = []
        self.ended: list[EndProcess] = []
        """Those that have ended, in that order."""
        self._signalled = signalled
        self._say = say
        self._show = show
        self._show_at = 0
        self._ask_at = NEVER
        self._kill_at = NEVER
        self._selector = DefaultSelector()
        self._selector.register(signalled, EVENT_READ, self._hand_on)

    @property
    def failed_first(self) -> EndProcess | None:
        """The first end that ended as it should not have."""
        return next((end for end in self.ended if end.has_failed), None)

    @property
    def is_ending(self) -> bool:
        """Return whether a signal has come or an end has ended."""
        return bool(self.ended) or self._signalled.came

    def add(self, end: EndProcess) -> None:
        """Watch one more."""
        self.ends.append(end)
        self._selector.register(end.reports, EVENT_READ, end.receive_reports)
        self._selector.register(end.errors, EVENT_READ, lambda: self._pass_on(end))
        self._selector.register(end.ended, EVENT_READ, lambda: self._has_ended(end))

    def wait_until(self, is_so: Callable[[], bool], timeout: int = NEVER) -> bool:
        """Watch until it is so, or everything ends, for so many ns at most; return whether it is.

        With a bound that is never reached, this ends when all ends have.
        """
        give_up_at = NEVER if timeout == NEVER else monotonic_ns() + timeout
        while not is_so() and monotonic_ns() < give_up_at:
            if self.is_ending and len(self.ended) == len(self.ends):
                break
            self._watch()
        return is_so()

    def end(self) -> None:
        """Ask all to end, and wait for them, for so long at most."""
        self._ask_to_end(signal.SIGTERM)
        self.wait_until(lambda: len(self.ended) == len(self.ends), 2 * TIMEOUT)

    def close(self) -> None:
        """Release everything; what still runs is killed."""
        self._selector.close()
        for end in self.ends:
            end.close()

    def _watch(self) -> None:
        timeout = min(self._ask_at - monotonic_ns(), SHOW_EVERY)
        for key, _ in self._selector.select(max(timeout, 0) / SECOND):
            key.data()
        now = monotonic_ns()
        if now >= self._show_at:
            self._show_at = now + SHOW_EVERY
            self._show()
        if now >= self._ask_at:
            self._ask_at = NEVER
            self._ask_to_end(signal.SIGTERM)
        if now >= self._kill_at:
            self._kill_at = NEVER
            self._kill()

    def _hand_on(self) -> None:
        """A signal for all: SIGINT as it is, so that a second one gives up as in any run."""
        self._signalled.take()
        is_interrupt = self._signalled.name == "SIGINT"
        self._ask_to_end(signal.SIGINT if is_interrupt else signal.SIGTERM)

    def _ask_to_end(self, number: signal.Signals) -> None:
        self._kill_at = min(self._kill_at, monotonic_ns() + TIMEOUT)
        for end in self.ends:
            if number == signal.SIGINT or not end.was_asked_to_end:
                end.ask_to_end(number)

    def _has_ended(self, end: EndProcess) -> None:
        for watched in (end.reports, end.errors, end.ended):
            self._selector.unregister(watched)
        end.wait()
        end.receive_reports()
        self._pass_on(end)
        self.ended.append(end)
        if end.status is not None and end.status > 128 and not end.was_asked_to_end:
            self._say(f"{end.role}: ended by {signal_name(end.status - 128)}")
        grace = 0 if end.has_failed else BY_ITSELF
        if not self._signalled.came:
            self._ask_at = min(self._ask_at, monotonic_ns() + grace)

    def _pass_on(self, end: EndProcess) -> None:
        for sentence in end.sentences():
            self._say(f"{end.role}: {sentence.removeprefix('firmware-runtime: ')}")

    def _kill(self) -> None:
        for end in self.ends:
            if end not in self.ended:
                timeout_s = TIMEOUT // SECOND
                self._say(f"{end.role}: did not end within {timeout_s} s of being asked; killed")
                end.kill()
