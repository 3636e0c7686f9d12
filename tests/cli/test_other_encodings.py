"""Standard output where the locale's encoding has few characters."""

import os
import subprocess
import sys
from io import BytesIO, TextIOWrapper
from pathlib import Path

import pytest

from firmware_runtime.system.terminal import output_checked
from tests.support.waiting import PATIENCE_S

ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
COMMAND = (sys.executable, "-m", "firmware_runtime.cli")


def in_ascii(*words: str, state: Path) -> "subprocess.CompletedProcess[bytes]":
    """The command where only ASCII can be printed."""
    environment = os.environ | ASCII | {"FIRMWARE_RUNTIME_STATE_DIRECTORY": str(state)}
    return subprocess.run(
        [*COMMAND, *words], env=environment, capture_output=True, timeout=PATIENCE_S, check=False
    )


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
    words = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", "1")
    ran = in_ascii(*words, state=tmp_path)
    assert (ran.returncode, ran.stderr) == (0, b"")
