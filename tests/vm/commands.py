"""Commands of this machine that make the guest."""

import subprocess
from pathlib import Path


class Unbuildable(Exception):
    """The image, or what is carried into it, could not be made."""


def show(line: str) -> None:
    """Show a line at once: a run takes minutes, and is watched."""
    print(line, flush=True)  # noqa: T201 -- a command prints


def run(*words: object, cwd: Path | None = None) -> str:
    """Run a command and return what it says. Raises Unbuildable with all of it."""
    command = [*map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False)
    if done.returncode != 0:
        raise Unbuildable(f"`{' '.join(command)}` failed:\n{done.stdout}{done.stderr}")
    return done.stdout
