"""Programs of the system that only note how they were called, and answer as they are to."""

import shlex
from pathlib import Path

_SCRIPT = """#!/bin/sh
printf '%s\\n' "{name} $*" >> {calls}
printf '%s' {out}
printf '%s' {error} >&2
exit {status}
"""


class RecordedPrograms:
    """A directory to be the whole PATH of a test."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self._calls = directory / "calls"
        directory.mkdir()

    def add(self, *names: str, out: str = "", error: str = "", status: int = 0) -> None:
        """Let these programs print this and end so."""
        for name in names:
            script = self.directory / name
            script.write_text(
                _SCRIPT.format(
                    name=name,
                    calls=shlex.quote(str(self._calls)),
                    out=shlex.quote(out),
                    error=shlex.quote(error),
                    status=status,
                )
            )
            script.chmod(0o755)

    @property
    def calls(self) -> list[str]:
        """Every call so far, program and arguments."""
        return self._calls.read_text().splitlines() if self._calls.exists() else []
