"""The command `firmware-runtime`: in this process, or in one of its own."""

import json
import subprocess
import sys
from typing import Any, NamedTuple

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.errors import Status
from tests.support.waiting import HANGS_S

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")
VIRTUAL = ("run", "tachobot", "--doubles", "--clock", "virtual")


class Ended(NamedTuple):
    """What a command left: its exit status and what it printed."""

    status: int
    out: str
    error: str


class Command:
    """The command in this process; it is called with the words of its line."""

    def __init__(self, capsys: pytest.CaptureFixture[str]) -> None:
        self._capsys = capsys

    def __call__(self, *words: object) -> Ended:
        try:
            status = main([str(each) for each in words])
        except SystemExit as end:
            status = int(end.code or 0)
        return Ended(status, *self._capsys.readouterr())

    def refused(self, *words: object, status: int = Status.BAD_INPUT) -> str:
        """Return what is said by one that ends with this status and prints nothing else."""
        ended = self(*words)
        assert (ended.status, ended.out) == (status, ""), ended
        return ended.error

    def said(self, *words: object) -> str:
        """Return what is printed by one that ends well."""
        ended = self(*words)
        assert ended.status == Status.OK, ended
        return ended.out

    def document(self, *words: object) -> Any:  # noqa: ANN401 -- as of json.loads
        """Return the JSON that is printed by one that ends well."""
        return json.loads(self.said(*words, "--json"))


def own_process(
    *words: object,
    check: bool = False,
    **options: Any,  # noqa: ANN401 -- of subprocess.run
) -> "subprocess.CompletedProcess[str]":
    """Run the command in a process of its own, to its end."""
    return ended_program([*COMMAND, *words], check=check, **options)


def in_python(
    program: str,
    *words: object,
    check: bool = False,
    **options: Any,  # noqa: ANN401 -- of subprocess.run
) -> "subprocess.CompletedProcess[str]":
    """Run a program in a Python of its own, to its end."""
    return ended_program([sys.executable, "-c", program, *words], check=check, **options)


def ended_program(
    words: list[Any],
    *,
    check: bool,
    **options: Any,  # noqa: ANN401 -- of subprocess.run
) -> "subprocess.CompletedProcess[str]":
    """Run a program to its end; it has its time, and what it prints is kept."""
    chosen = {"capture_output": True, "text": True, "timeout": HANGS_S, **options}
    return subprocess.run([*map(str, words)], check=check, **chosen)


def started(*words: object, **options: Any) -> "subprocess.Popen[str]":  # noqa: ANN401 -- of Popen
    """Start the command in a process of its own; what it prints can be read line by line."""
    chosen = {"stdout": subprocess.PIPE, "text": True, **options}
    return subprocess.Popen([*COMMAND, *map(str, words)], **chosen)
