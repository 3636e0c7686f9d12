"""A robot whose model takes longer than its period, as a command of its own."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.support.waiting import PATIENCE_S

pytestmark = [pytest.mark.slow, pytest.mark.real_time]

PROGRAM = """
import sys
from time import monotonic_ns
from boards.tachobot.attitude import Attitude
from firmware_runtime.cli.main import main
external = Attitude.external
def slow(self, elapsed):
    until = monotonic_ns() + 199_000_000
    while monotonic_ns() < until:
        pass
    external(self, elapsed)
Attitude.external = slow
sys.exit(main(sys.argv[1:]))
"""


def overloaded(folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    """TachoBot on its doubles, 199 ms in one model at each of its activations, due every 10 ms."""
    statistics = ("--statistics", str(folder / "x.stats"))
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, "run", "tachobot", "--doubles", *statistics, *words],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )


def test_it_says_so_and_its_statistics_do(tmp_path: Path) -> None:
    ended = overloaded(tmp_path, "--for", "10", "--json")
    assert "overload: " in ended.stderr
    statistics: dict[str, Any] = json.loads(ended.stdout)["statistics"]
    assert statistics["conditions"]["run"]["overloaded_s"] > 0
    assert not statistics["conditions"]["settings"]["fifo_priority"]["granted"]


def test_it_ends_where_the_board_says_so(tmp_path: Path) -> None:
    ended = overloaded(tmp_path, "--for", "60", "--set", "executive.overload=stop")
    assert ended.returncode == 1
    assert "overload: " in ended.stderr
