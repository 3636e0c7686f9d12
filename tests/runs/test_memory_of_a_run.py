"""A run fits a computer of 512 MB: its memory beside the recording's ring, and the ring's size."""

import os
from pathlib import Path

import pytest

from tests.support.command import Command, in_python

pytestmark = pytest.mark.slow

MOST = 45_000_000
"""Bytes that are resident beside the ring."""
ZERO_2_W = 416 << 20
"""Bytes that are left of 512 MiB beside the firmware's."""

PROGRAM = """
import re, sys
from contextlib import suppress
from pathlib import Path
from firmware_runtime import open_board
from firmware_runtime.errors import FirmwareRuntimeError
name, statistics = sys.argv[1:]
with open_board(name, doubles=True, statistics=statistics) as robot:
    with suppress(FirmwareRuntimeError):  # of a machine that is too busy for it
        robot.run(0.5)
    ring = rest = 0
    mapped = ""
    for line in Path("/proc/self/smaps").read_text().splitlines():
        if re.match("[0-9a-f]+-[0-9a-f]+ ", line):
            mapped = line
        if line.startswith("Rss:"):
            taken = int(line.split()[1]) * 1024
            is_ring = mapped.endswith(".recording")
            ring, rest = ring + taken * is_ring, rest + taken * (not is_ring)
    print(ring, rest)
"""


@pytest.mark.real_time
@pytest.mark.parametrize("board", ["tachobot", "detective"])
def test_a_run_takes_little_memory_beside_its_ring(tmp_path: Path, board: str) -> None:
    said = in_python(PROGRAM, board, tmp_path / "it.stats", check=True).stdout
    ring, rest = map(int, said.split())
    assert ring > 0
    assert rest <= MOST


def test_a_small_computer_keeps_less_of_a_run(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    sizes = {"SC_PHYS_PAGES": ZERO_2_W // 4096, "SC_PAGE_SIZE": 4096}
    monkeypatch.setattr(os, "sysconf", sizes.__getitem__)
    said = command.said("check", "tachobot")
    assert "recording: the last 7 of 10 min in 27 MiB, which is the most" in said
