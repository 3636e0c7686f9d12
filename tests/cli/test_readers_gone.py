"""What a command's status is when its output has no reader any more."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.waiting import PATIENCE_S

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")


def status_unread(*words: str, program: tuple[str, ...] = COMMAND) -> int:
    """Exit status with standard output and standard error at pipes without a reader."""
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [*program, *words], stdout=writing, stderr=writing, timeout=PATIENCE_S, check=False
    )
    os.close(writing)
    return done.returncode


@pytest.mark.slow
def test_a_verb_that_only_shows_something_is_done() -> None:
    assert status_unread("show") == 0


@pytest.mark.slow
def test_bad_input_is_still_bad_input() -> None:
    assert status_unread("check", "no-such-board") == 2


@pytest.mark.slow
def test_outputs_that_could_not_be_switched_off_are_still_on(tmp_path: Path) -> None:
    nowhere = str(tmp_path / "no-doubles")
    program = (
        "import sys\n"
        "from firmware_runtime.cli.commands import safe_state\n"
        "from firmware_runtime.cli.main import main\n"
        "safe_state.TIMEOUT = 0\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    words = ("safe-state", "tachobot", "--doubles", nowhere)
    assert status_unread(*words, program=(sys.executable, "-c", program)) == 4


@pytest.mark.slow
def test_a_run_that_failed_has_failed(tmp_path: Path) -> None:
    program = (
        "import sys\n"
        "from firmware_boards.tachobot.attitude import Attitude\n"
        "from firmware_runtime.cli.main import main\n"
        "def external(self, elapsed): raise ValueError('a bug')\n"
        "Attitude.external = external\n"
        "sys.exit(main(sys.argv[1:]))\n"
    )
    words = ("run", "tachobot", "--doubles", "--clock", "virtual", "--json")
    statistics = ("--statistics", str(tmp_path / "x.stats"))
    assert status_unread(*words, *statistics, program=(sys.executable, "-c", program)) == 1


@pytest.mark.slow
@pytest.mark.parametrize("words", [("show",), ("check", "no-such-board")])
def test_without_any_output_to_write_to_the_status_is_the_same(words: tuple[str, ...]) -> None:
    closing = ["sh", "-c", 'exec "$@" >&- 2>&-', "sh", *COMMAND, *words]
    assert subprocess.run(closing, timeout=PATIENCE_S, check=False).returncode == status_unread(
        *words
    )
