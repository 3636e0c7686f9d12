"""Runs other programs, or prints their command lines only; keeps what they print."""

import shlex
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple, TypeAlias

from firmware_runtime.host.deployment.errors import DeploymentError

TIMEOUT_S = 900.0
"""How long one command may take; installing on a small computer takes minutes."""

Log: TypeAlias = Callable[[str], None]


class Ended(NamedTuple):
    """What a command left."""

    status: int
    out: str
    error: str

    @property
    def reason(self) -> str:
        """The last line it complained with."""
        lines = [line.strip() for line in self.error.splitlines() if line.strip()]
        return lines[-1] if lines else f"ended with status {self.status} and said nothing"


class Commands:
    """Runs commands one after the other; in a dry run prints them as a shell would take them."""

    def __init__(self, log: Log, *, dry_run: bool = False) -> None:
        self.log = log
        self.dry_run = dry_run

    def run(self, command: Sequence[str], scripts: Sequence[Path] = ()) -> Ended:
        """Run a command to its end, with scripts on its standard input.

        Raises DeploymentError when it is not installed or never ends.
        """
        if self.dry_run:
            return self._say(command, scripts)
        text = "".join(script.read_text() for script in scripts)
        try:
            done = subprocess.run(  # noqa: S603 -- no shell, and the words are our own
                command,
                input=text,
                capture_output=True,
                encoding="utf-8",
                errors="replace",
                check=False,
                timeout=TIMEOUT_S,
            )
        except FileNotFoundError as error:
            raise DeploymentError(
                f"{command[0]}: not found; expected it to be installed"
            ) from error
        except subprocess.TimeoutExpired as error:
            raise DeploymentError(f"{command[0]}: no end after {TIMEOUT_S:g} s") from error
        return Ended(done.returncode, done.stdout, done.stderr)

    def demand(self, command: Sequence[str], what: str) -> None:
        """Run a command that has to succeed. Raises DeploymentError with its last line."""
        ended = self.run(command)
        if ended.status != 0:
            raise DeploymentError(f"{what}: {ended.reason}")

    def _say(self, command: Sequence[str], scripts: Sequence[Path]) -> Ended:
        before = f"{shlex.join(['cat', *map(str, scripts)])} | " if scripts else ""
        self.log(f"  {before}{shlex.join(command)}")
        return Ended(0, "", "")
