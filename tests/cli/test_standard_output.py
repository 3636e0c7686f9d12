"""Standard output that is full, closed, has no reader, or has few characters; no standard input."""

import os
import subprocess
import sys
from collections.abc import Callable
from io import BytesIO, TextIOWrapper
from pathlib import Path

import pytest

from firmware_runtime.cli.main import main
from firmware_runtime.errors import Status
from firmware_runtime.system.terminal import output_checked
from tests.support.command import COMMAND, VIRTUAL, Command, own_process
from tests.support.waiting import PATIENCE_S

BRIEF = (*VIRTUAL, "--for", "1")
NO_ROOM = "firmware-runtime: standard output: No space left on device; expected room for all of it"
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
UNSAFE = """
import sys
from firmware_runtime.cli.commands import safe_state
from firmware_runtime.cli.main import main
safe_state.TIMEOUT = 0
sys.exit(main(sys.argv[1:]))
"""
BROKEN = """
import sys
from firmware_boards.tachobot.attitude import Attitude
from firmware_runtime.cli.main import main
def external(self, elapsed): raise ValueError('a bug')
Attitude.external = external
sys.exit(main(sys.argv[1:]))
"""


def full(*words: str, buffered: bool) -> "subprocess.CompletedProcess[str]":
    """The command with its standard output at a full disk."""
    program = [COMMAND[0], *([] if buffered else ["-u"]), *COMMAND[1:], *words]
    with Path("/dev/full").open("w") as output:
        return subprocess.run(
            program,
            stdout=output,
            stderr=subprocess.PIPE,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "buffered"), [(("show",), True), (BRIEF, False), ((*BRIEF, "--json"), True)]
)
def test_what_could_not_be_printed_is_one_sentence(
    words: tuple[str, ...], *, buffered: bool
) -> None:
    ended = full(*words, buffered=buffered)
    assert (ended.returncode, ended.stderr) == (Status.NOT_PRINTED, f"{NO_ROOM}\n")


@pytest.mark.parametrize("line_buffering", [True, False])
@pytest.mark.parametrize(
    "words", [("show", "tachobot"), ("check", "tachobot"), ("stats", "--json")]
)
def test_what_any_verb_could_not_print_is_one_sentence(
    words: tuple[str, ...],
    state_directory: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    *,
    line_buffering: bool,
) -> None:
    assert main([*BRIEF, "--statistics", str(state_directory / "x.stats")]) == Status.OK
    capsys.readouterr()
    with Path("/dev/full").open("wb", buffering=0) as output:
        stream = TextIOWrapper(output, line_buffering=line_buffering)
        monkeypatch.setattr(sys, "stdout", stream)
        assert main([*words]) == Status.NOT_PRINTED
        monkeypatch.undo()
        stream.detach()
    assert capsys.readouterr().err == f"{NO_ROOM}\n"


@pytest.mark.slow
def test_bad_input_is_still_bad_input_where_output_is_full() -> None:
    ended = full("check", "no-such-board", buffered=False)
    assert ended.returncode == Status.BAD_INPUT
    assert "standard output" not in ended.stderr


def unread(*words: str) -> int:
    """Exit status with standard output and standard error at pipes without a reader."""
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(words, stdout=writing, stderr=writing, timeout=PATIENCE_S, check=False)
    os.close(writing)
    return done.returncode


def closed(*words: str) -> int:
    """Exit status without any output to write to."""
    closing = ["sh", "-c", 'exec "$@" >&- 2>&-', "sh", *words]
    return subprocess.run(closing, timeout=PATIENCE_S, check=False).returncode


@pytest.mark.slow
@pytest.mark.parametrize("missing", [unread, closed])
@pytest.mark.parametrize(
    ("words", "status"), [(("show",), Status.OK), (("check", "no-such-board"), Status.BAD_INPUT)]
)
def test_without_a_reader_the_status_is_the_same(
    missing: Callable[..., int], words: tuple[str, ...], status: Status
) -> None:
    assert missing(*COMMAND, *words) == status


@pytest.mark.slow
@pytest.mark.parametrize(
    ("program", "words", "status"),
    [
        (UNSAFE, ("safe-state", "tachobot", "--doubles", "{}/none"), Status.NOT_SAFE),
        (BROKEN, (*VIRTUAL, "--json", "--statistics", "{}/x.stats"), Status.MODEL_ERROR),
    ],
    ids=["outputs are still on", "the run has failed"],
)
def test_without_a_reader_what_failed_has_failed(
    tmp_path: Path, program: str, words: tuple[str, ...], status: Status
) -> None:
    line = [word.format(tmp_path) for word in words]
    assert unread(sys.executable, "-c", program, *line) == status


def test_a_character_that_the_encoding_lacks_is_escaped(monkeypatch: pytest.MonkeyPatch) -> None:
    printed = BytesIO()
    stream = TextIOWrapper(printed, encoding="ascii")
    monkeypatch.setattr("sys.stdout", stream)
    with output_checked():
        print("smooth-é", flush=True)  # noqa: T201 -- what is tested
    assert printed.getvalue() == b"smooth-\\xe9\n"
    assert stream.errors == "strict"


@pytest.mark.slow
def test_a_run_is_shown_in_ascii(tmp_path: Path) -> None:
    state = {"FIRMWARE_RUNTIME_STATE_DIRECTORY": str(tmp_path)}
    ran = own_process(*BRIEF, env=os.environ | ASCII | state)
    assert (ran.returncode, ran.stderr) == (0, "")


@pytest.mark.slow
def test_a_run_needs_no_standard_input(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", None)  # as where a service manager has closed it
    assert command(*BRIEF).status == Status.OK
