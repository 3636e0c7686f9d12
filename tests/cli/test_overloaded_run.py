"""A robot whose model takes longer than its period, as a command of its own."""

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support.waiting import PATIENCE_S

pytestmark = [pytest.mark.slow, pytest.mark.real_time]

PROGRAM = """
import sys
from time import sleep
from firmware_boards.tachobot.attitude import Attitude
from firmware_runtime.cli.main import main
external = Attitude.external
def slow(self, elapsed):
    sleep(0.199)
    external(self, elapsed)
Attitude.external = slow
sys.exit(main(sys.argv[1:]))
"""


def overloaded(folder: Path, *words: str) -> "subprocess.Popen[str]":
    """TachoBot on its doubles, 199 ms in one model at each of its activations, due every 10 ms."""
    statistics = ("--statistics", str(folder / "x.stats"), "--for", "600")
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "run", "tachobot", "--doubles", *statistics, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_it_says_so_and_its_statistics_do(tmp_path: Path) -> None:
    with overloaded(tmp_path, "--json") as run:
        assert run.stderr is not None
        assert any("overload: " in line for line in run.stderr)
        run.send_signal(signal.SIGINT)
        printed, _ = run.communicate(timeout=PATIENCE_S)
    statistics: dict[str, Any] = json.loads(printed)["statistics"]
    assert statistics["conditions"]["run"]["overloaded_s"] > 0
    assert not statistics["conditions"]["settings"]["fifo_priority"]["granted"]


def test_it_ends_where_the_board_says_so(tmp_path: Path) -> None:
    with overloaded(tmp_path, "--set", "executive.overload=stop") as run:
        said = run.communicate(timeout=PATIENCE_S)[1]
    assert run.returncode == 1
    assert "overload: " in said
