"""Standard output that takes no more: one sentence and a status, never a traceback."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.waiting import PATIENCE_S

COMMAND = (sys.executable, "-m", "firmware_runtime.cli")
VIRTUAL = ("run", "tachobot", "--doubles", "--clock", "virtual", "--for", "1")


def full(*words: str, buffered: bool = True) -> "subprocess.CompletedProcess[str]":
    """The command with its standard output at a full disk."""
    with Path("/dev/full").open("w") as output:
        return subprocess.run(
            [COMMAND[0], *([] if buffered else ["-u"]), *COMMAND[1:], *words],
            stdout=output,
            stderr=subprocess.PIPE,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )


@pytest.mark.slow
@pytest.mark.parametrize("buffered", [True, False])
@pytest.mark.parametrize(
    "words",
    [("show",), ("show", "tachobot"), ("check", "tachobot"), VIRTUAL, (*VIRTUAL, "--json")],
)
def test_what_could_not_be_printed_is_one_sentence(words: tuple[str, ...], buffered: bool) -> None:  # noqa: FBT001 -- a parameter of the test
    ended = full(*words, buffered=buffered)
    assert ended.returncode == 10
    assert ended.stderr.splitlines() == [
        "firmware-runtime: standard output: No space left on device; expected room for all of it"
    ]


@pytest.mark.slow
def test_statistics_that_could_not_be_printed_are_one_sentence(tmp_path: Path) -> None:
    kept = str(tmp_path / "kept.stats")
    subprocess.run(
        [*COMMAND, *VIRTUAL, "--statistics", kept], stdout=subprocess.DEVNULL, check=True
    )
    ended = full("stats", "--statistics", kept, "--json")
    assert (ended.returncode, len(ended.stderr.splitlines())) == (10, 1)


@pytest.mark.slow
def test_bad_input_is_still_bad_input() -> None:
    ended = full("check", "no-such-board", buffered=False)
    assert ended.returncode == 2
    assert "standard output" not in ended.stderr
