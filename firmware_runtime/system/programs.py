"""Programs that are run to their end, and processes that are waited for."""

import shlex
import subprocess
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from firmware_runtime.errors import FirmwareRuntimeError


class ProgramFailed(FirmwareRuntimeError):
    """A program cannot be run here, does not end in time, or ends with a failure."""


class Ended(NamedTuple):
    """Result of a program."""

    status: int
    out: str
    error: str

    @property
    def reason(self) -> str:
        """The last line it complained with."""
        lines = [line.strip() for line in self.error.splitlines() if line.strip()]
        return lines[-1] if lines else f"ended with status {self.status} and said nothing"

    @property
    def complaint(self) -> str:
        """All that it complained of, in one line; empty if it said nothing."""
        return " ".join(self.error.split())


def run_program(
    words: Sequence[str],
    *,
    text: str = "",
    timeout_s: float | None = None,
    environment: Mapping[str, str] | None = None,
) -> Ended:
    """Run a program to its end, whatever that is, with a text on its standard input.

    Raises ProgramFailed for one that cannot be run, or does not end in time.
    """
    try:
        done = subprocess.run(  # noqa: S603 -- no shell, and the words are our own
            words,
            input=text,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            env=environment,
            timeout=timeout_s,
            check=False,
        )
    except OSError as error:
        fault = f"cannot be run ({error.strerror}), expected it on the path"
        raise ProgramFailed(fault, where=words[0]) from error
    except subprocess.TimeoutExpired as error:
        raise ProgramFailed(f"no end after {timeout_s:g} s", where=words[0]) from error
    return Ended(done.returncode, done.stdout, done.stderr)


def answer_of(
    words: Sequence[str],
    *,
    timeout_s: float | None = None,
    environment: Mapping[str, str] | None = None,
) -> str:
    """Return what a program prints. Raises ProgramFailed, also with what it says when it fails."""
    ended = run_program(words, timeout_s=timeout_s, environment=environment)
    if ended.status != 0:
        fault = f"ended with status {ended.status}: {ended.complaint or 'it said nothing'}"
        raise ProgramFailed(fault, where=shlex.join(words))
    return ended.out


def end_within(process: "subprocess.Popen[Any]", timeout_s: float) -> None:
    """Wait for a process that is to end; one that does not in time is killed."""
    try:
        process.wait(timeout_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
