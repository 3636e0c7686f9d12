"""Asks the command for completions as the script of a shell does."""

import io

import pytest
from argcomplete.finders import CompletionFinder

from firmware_runtime.cli import completer

BETWEEN = "\v"
"""What argcomplete puts between its answers."""


def asked_for(*words: str, shell: str = "bash") -> dict[str, str]:
    """The environment in which a shell asks how these words may go on."""
    line = " ".join(["firmware-runtime", *words])
    return {
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_SHELL": shell,
        "_ARGCOMPLETE_SUPPRESS_SPACE": "1",
    }


def ways_on(*words: str, shell: str = "bash") -> list[str]:
    """How these words may go on, the last of them included."""
    written = io.StringIO()
    with pytest.MonkeyPatch.context() as patch:
        for name, value in asked_for(*words, shell=shell).items():
            patch.setenv(name, value)
        patch.setattr(CompletionFinder, "_init_debug_stream", _keep_files_open)
        completer.complete(written, leave=int)
    return written.getvalue().split(BETWEEN) if written.getvalue() else []


def _keep_files_open(_: CompletionFinder) -> None:
    """Leave file 9 alone: it is the script's at a Tab, and the test runner's here."""
