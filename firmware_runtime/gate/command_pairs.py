"""Pairs of runs of a command, each version in its own folder and first on its import path.

The cost of a run is the processor time, user and system, of the command and of what it has started
and waited for. Both runs of a pair are on one processor, one after the other; which is first is
drawn by the seed.
"""

import os
import select
import shlex
import signal
import subprocess
import tempfile
from collections.abc import Generator, Sequence
from contextlib import suppress
from itertools import cycle
from random import Random

from firmware_runtime.errors import ConfigError
from firmware_runtime.gate.checkouts import Checkout
from firmware_runtime.gate.pairs import Pair
from firmware_runtime.gate.surroundings import environment, processors
from firmware_runtime.system.signals import signals_held

LONGEST_S = 600.0
"""A run that takes longer is given up."""


class CommandPairs:
    """Measures a command in two versions."""

    unit = "a run of the command"
    units = 1.0

    def __init__(
        self, versions: tuple[Checkout, Checkout], command: Sequence[str], seed: int
    ) -> None:
        self._versions, self._command = versions, list(command)
        self._draws = Random(seed)  # noqa: S311 -- no secret

    def notes(self) -> list[str]:
        """None: what a command does is not known."""
        return []

    def pairs(self) -> Generator[Pair, None, None]:
        """Pairs without end. Raises ConfigError for a command that fails."""
        base, head = self._versions
        cpus = list(processors())
        self._draws.shuffle(cpus)
        for checkout in self._versions:  # what the first run compiles and reads is no cost
            self._cost_ns(checkout, cpus[0])
        for cpu in cycle(cpus):
            if self._draws.random() < 0.5:
                base_ns = self._cost_ns(base, cpu)
                yield Pair(base_ns, self._cost_ns(head, cpu))
            else:
                head_ns = self._cost_ns(head, cpu)
                yield Pair(self._cost_ns(base, cpu), head_ns)

    # ---------------------------------------------------------------------------------------------

    def _cost_ns(self, checkout: Checkout, cpu: int) -> int:
        """Run it once. Raises ConfigError where it cannot be run, or does not end well."""
        with tempfile.TemporaryFile() as printed:
            process: subprocess.Popen[bytes] | None = None
            cost_s = 0.0
            try:
                with signals_held():  # or a signal could part it from what ends it
                    process = self._started(checkout, cpu, printed.fileno())
                has_ended = _has_ended(process)
            except OSError as error:
                raise self._failure(checkout, f"{error.strerror}") from error
            finally:
                if process is not None:
                    cost_s = _end(process)
            if has_ended and process.returncode == 0:
                return max(round(cost_s * 1e9), 1)
            printed.seek(0)
            said = printed.read().decode(errors="replace").strip().splitlines()
        ended = f"it ended with {process.returncode}" if has_ended else f"no end in {LONGEST_S:g} s"
        raise self._failure(checkout, ": ".join([ended, *said[-1:]]))

    def _started(self, checkout: Checkout, cpu: int, output: int) -> "subprocess.Popen[bytes]":
        """Start it on one processor, which it has from this process."""
        before = os.sched_getaffinity(0)
        os.sched_setaffinity(0, {cpu})
        try:
            return subprocess.Popen(  # noqa: S603 -- the user's own command
                self._command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                cwd=checkout.folder,
                env=environment(checkout),
                start_new_session=True,
            )
        finally:
            os.sched_setaffinity(0, before)

    def _failure(self, checkout: Checkout, what: str) -> ConfigError:
        where = f"{checkout.name} {checkout.stated}"
        expected = "expected a command that ends with 0 there"
        return ConfigError.of_one(where, f"{shlex.join(self._command)}: {what}; {expected}")


def _has_ended(process: "subprocess.Popen[bytes]") -> bool:
    """Wait until it has, or for the longest time allowed."""
    pidfd = os.pidfd_open(process.pid)
    try:
        return bool(select.select([pidfd], [], [], LONGEST_S)[0])
    finally:
        os.close(pidfd)


def _end(process: "subprocess.Popen[bytes]") -> float:
    """End it with all that it has started and left behind; its processor time in s."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime
