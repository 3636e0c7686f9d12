"""Runs other programs, or prints their command lines only; keeps what they print."""

import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

from firmware_runtime.errors import DeploymentError
from firmware_runtime.system.programs import Ended, ProgramFailed, run_program

TIMEOUT_S = 900.0
"""How long one command may take; installing on a small computer takes minutes."""

Log: TypeAlias = Callable[[str], None]


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
            return run_program(command, text=text, timeout_s=TIMEOUT_S)
        except ProgramFailed as error:
            raise DeploymentError(str(error)) from error

    def demand(self, command: Sequence[str], what: str) -> None:
        """Run a command that has to succeed. Raises DeploymentError with its last line."""
        ended = self.run(command)
        if ended.status != 0:
            raise DeploymentError(ended.reason, where=what)

    def _say(self, command: Sequence[str], scripts: Sequence[Path]) -> Ended:
        before = f"{shlex.join(['cat', *map(str, scripts)])} | " if scripts else ""
        self.log(f"  {before}{shlex.join(command)}")
        return Ended(0, "", "")
