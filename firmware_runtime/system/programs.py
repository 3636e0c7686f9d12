"""Programs that are run to their end, and processes that are waited for."""

import subprocess
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from firmware_runtime.errors import FirmwareRuntimeError


class NotRun(FirmwareRuntimeError):
    """A program cannot be run here, or does not end in time."""


class Ended(NamedTuple):
    """What a program left."""

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
        """All that it complained of, in one line."""
        return " ".join(self.error.split()) or self.reason


def run_program(
    words: Sequence[str],
    *,
    text: str = "",
    timeout_s: float | None = None,
    environment: Mapping[str, str] | None = None,
) -> Ended:
    """Run a program to its end, with a text on its standard input. Raises NotRun."""
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
        raise NotRun(f"{words[0]}: cannot be run ({error.strerror})") from error
    except subprocess.TimeoutExpired as error:
        raise NotRun(f"{words[0]}: no end after {timeout_s:g} s") from error
    return Ended(done.returncode, done.stdout, done.stderr)


def end_within(process: "subprocess.Popen[Any]", timeout_s: float) -> None:
    """Wait for a process that is to end; one that does not in time is killed."""
    try:
        process.wait(timeout_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
