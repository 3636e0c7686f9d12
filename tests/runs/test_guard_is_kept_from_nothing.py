"""What a guard meets besides a run that dies: none of it ends it, or comes before the outputs."""

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from time import monotonic_ns
from typing import Any

import pytest
from msgspec.structs import asdict

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.runs.guard import Guard, Phase
from firmware_runtime.runs.watched_run import WatchedRun, keep_clear_of_other_runs
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.file_header import STATISTICS
from firmware_runtime.statistics.layout import GUARD, HEARTBEAT, Layout
from firmware_runtime.statistics.mapped_file import PREFIX
from firmware_runtime.statistics.takeovers import Takeover
from firmware_runtime.system.process_identity import this_process

HEADER = {"models": {}, "conditions": {"board": "tachobot", "switched_off": ["here: 00"]}}
STALL = 20 * SECOND
"""Longer than a busy machine holds up a test."""
ERRORS = [
    KeyError("x"),
    TypeError("x"),
    OverflowError(),
    MemoryError(),
    RecursionError(),
    OSError(),
]


class Watch:
    """A guard and what it does, in order; each of its parts may be made to raise."""

    def __init__(self, path: Path) -> None:
        self.done: list[str] = []
        self.raising: dict[str, Exception] = {}
        self.guard = Guard(path, self, STALL, self.log, self.record)

    def _do(self, what: str) -> None:
        self.done.append(what)
        if what in self.raising:
            raise self.raising[what]

    def make_safe(self) -> list[str]:
        self._do("off")
        return []

    def why_unguarded(self, _conditions: Mapping[str, Any]) -> str | None:
        self._do("why_unguarded")
        return None

    def reach(self) -> None:
        self._do("reach")

    def log(self, _what: str) -> None:
        self._do("log")

    def record(self, _takeover: Takeover) -> None:
        self._do("record")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "tachobot.stats"


@pytest.fixture
def watch(path: Path) -> Watch:
    return Watch(path)


@pytest.fixture
def file(path: Path) -> StatisticsFile:
    file = StatisticsFile(Layout(), HEADER, path)
    file.close_section(0)
    return file


def hang(file: StatisticsFile) -> None:
    file.cells[HEARTBEAT] = monotonic_ns() - 2 * STALL


def guard_seen_at(path: Path) -> int:
    with STATISTICS.opened(path) as file:
        return memoryview(file.read(8 * GUARD, 8)).cast("q")[0]


def with_header(path: Path, **header: object) -> None:
    """A statistics file that is whole but for what its header says."""
    layout = Layout()
    path.write_bytes(STATISTICS.encode(header, layout.cells) + bytes(8 * layout.cells))


def test_outputs_come_before_every_word(watch: Watch, file: StatisticsFile) -> None:
    watch.guard.poll()
    watch.done.clear()
    hang(file)
    watch.guard.poll()
    assert watch.done == ["off", "log", "record"]


@pytest.mark.parametrize("error", ERRORS, ids=lambda each: type(each).__name__)
@pytest.mark.parametrize("part", ["log", "record", "off", "why_unguarded"])
def test_whatever_is_raised_outputs_are_written_poll_after_poll(
    watch: Watch, file: StatisticsFile, part: str, error: Exception
) -> None:
    watch.raising[part] = error
    watch.guard.poll()
    hang(file)
    for _ in range(3):
        watch.guard.poll()
    assert watch.done.count("off") == 3
    assert watch.guard.phase is Phase.HOLDING


DAMAGED: dict[str, Any] = {
    "empty": {},
    "no conditions": {"writer": {"pid": 1, "started_ticks": 1, "boot_id": ""}},
    "writer a list": {"writer": [], "conditions": {}},
    "writer without keys": {"writer": {}, "conditions": {}},
    "number too large": {
        "writer": {"pid": 10**30, "started_ticks": 1, "boot_id": ""},
        "conditions": {},
    },
    "number of a group": {
        "writer": {"pid": -1, "started_ticks": 1, "boot_id": ""},
        "conditions": {},
    },
    "number a text": {"writer": {"pid": "1", "started_ticks": 1, "boot_id": ""}, "conditions": {}},
    "conditions a text": {"writer": asdict(this_process()), "conditions": "none"},
}


@pytest.mark.parametrize("header", DAMAGED.values(), ids=DAMAGED)
def test_a_header_that_is_of_no_use_is_logged_once_and_replaced_by_a_new_run(
    path: Path, watch: Watch, header: dict[str, Any]
) -> None:
    with_header(path, **header)
    for _ in range(3):
        watch.guard.poll()
    assert watch.done == ["log"]
    assert "no usable" in str(keep_clear_of_other_runs(path))
    StatisticsFile(Layout(), HEADER, path)
    watch.guard.poll()
    assert watch.guard.phase is Phase.WATCHING


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"FWRTSTAT",
        bytes(100),
        PREFIX.pack(b"FWRTSTAT", STATISTICS.schema, 64, 10**12) + bytes(32),
        PREFIX.pack(b"FWRTSTAT", STATISTICS.schema, 100_032, 100_000) + b"[" * 100_000,
    ],
    ids=["empty", "cut", "zeros", "header longer than the file", "nested too deep"],
)
def test_a_file_of_another_format_is_logged_once(path: Path, watch: Watch, content: bytes) -> None:
    path.write_bytes(content)
    for _ in range(3):
        watch.guard.poll()
    assert watch.done == ["log"]
    assert keep_clear_of_other_runs(path) is not None


def test_a_header_that_would_fill_the_memory_is_not_read(path: Path) -> None:
    size = 1 << 40
    path.write_bytes(PREFIX.pack(b"FWRTSTAT", STATISTICS.schema, size, size - PREFIX.size))
    os.truncate(path, size)
    with pytest.raises(StatisticsFileError, match="a header of"):
        WatchedRun(path)


def test_a_fifo_in_place_of_the_file_is_not_waited_for(path: Path, watch: Watch) -> None:
    os.mkfifo(path)
    watch.guard.poll()
    assert watch.done == ["log"]
    assert "no regular file" in str(keep_clear_of_other_runs(path))


def test_a_directory_in_place_of_the_file_is_logged(path: Path, watch: Watch) -> None:
    path.mkdir()
    watch.guard.poll()
    assert watch.done == ["log"]


def test_a_path_that_leads_nowhere_is_no_run(path: Path, watch: Watch) -> None:
    path.symlink_to(path)
    watch.guard.poll()
    assert watch.done == []


@pytest.fixture
def other(path: Path) -> Iterator["subprocess.Popen[bytes]"]:
    """Another process that keeps its statistics at the path, until it is killed."""
    program = (
        "import sys; from pathlib import Path;"
        "from firmware_runtime.statistics.layout import Layout;"
        "from firmware_runtime.statistics.file import StatisticsFile;"
        f"file = StatisticsFile(Layout(), {HEADER!r}, Path(sys.argv[1]));"
        "print('there', flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", program, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as run:
        assert run.stdout is not None
        run.stdout.readline()
        yield run
        run.kill()


def test_a_run_that_drives_is_watched_on_whatever_takes_the_place_of_its_file(
    path: Path, watch: Watch, other: "subprocess.Popen[bytes]"
) -> None:
    watch.guard.poll()
    whole = path.read_bytes()
    path.unlink()
    path.write_bytes(whole)
    watch.guard.poll()
    path.unlink()
    StatisticsFile(Layout(), HEADER, path).close_section(0)
    watch.guard.poll()
    assert "off" not in watch.done
    other.kill()
    other.wait()
    watch.guard.poll()
    assert watch.done.count("off") == 1
    watch.guard.poll()
    assert watch.guard.phase is Phase.WATCHING
    assert guard_seen_at(path) > 0
