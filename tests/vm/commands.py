"""Commands of this machine that make the guest."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path


class Unbuildable(Exception):
    """The image, or what is carried into it, could not be made."""


def end_in_order() -> None:
    """Let SIGTERM, as of `timeout`, undo what is open; it would leave a QEMU behind."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))


def lacking(needed: Mapping[str, str], command: str, root_for: str = "") -> str | None:
    """What is missing for a command of make, in a sentence: programs, or a superuser.

    `needed` are programs, and the Debian packages they come in; `root_for` says what takes root.
    """
    packages = [package for program, package in needed.items() if shutil.which(program) is None]
    if packages:
        return f"needs Debian packages: apt install {' '.join(dict.fromkeys(packages))}"
    if root_for and os.geteuid() != 0:
        return f"{root_for}, which only root may; expected sudo make {command}"
    return None


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
