"""Processes of a sweep that are killed: what was finished is kept, and the table is the same."""

import os
import signal
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from queue import SimpleQueue
from threading import Event

import pytest
from msgspec import Struct

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.sweeps import cluster as sweeps_cluster
from firmware_runtime.lab.sweeps import sweep
from firmware_runtime.lab.sweeps.local_pool import run_here
from firmware_runtime.lab.sweeps.partial import partial_of
from firmware_runtime.lab.sweeps.plan import Sweep
from firmware_runtime.lab.sweeps.row import Row
from firmware_runtime.lab.sweeps.sweeping import carry_out
from tests.support.dask_cluster import cluster
from tests.support.waiting import wait_until

ROWS = 12
SHORT = Sweep(
    board="tachobot",
    vary={"world.mass_kg": "uniform(2, 4)", "world.seed": f"range({ROWS})"},
    for_s=1.5,
)
COMMAND = [sys.executable, "-m", "firmware_runtime.cli", "sweep", "tachobot", "--for", "1.5"]
for _key, _words in SHORT.vary.items():
    COMMAND += ["--vary", f"{_key}={_words}"]


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The table that one process makes."""
    output = tmp_path_factory.mktemp("one") / "table.csv"
    carry_out(SHORT, output, workers=1)
    return output.read_bytes()


def finished(output: Path) -> int:
    """How many rows are kept beside a table to come."""
    kept = partial_of(output)
    return kept.read_bytes().count(b"\n") - 1 if kept.exists() else 0


def children(parent: int) -> list[int]:
    """The processes that another has started."""
    lists = Path(f"/proc/{parent}/task").glob("*/children")
    return [int(each) for found in lists for each in found.read_text().split()]


@pytest.mark.slow
@pytest.mark.parametrize("by", [signal.SIGKILL, signal.SIGINT])
def test_a_sweep_that_is_stopped_goes_on_to_the_same_table(
    by: signal.Signals, tmp_path: Path, expected: bytes
) -> None:
    output = tmp_path / "table.csv"
    words = [*COMMAND, "--workers", "2", "-o", str(output)]
    running = subprocess.Popen(words, stderr=subprocess.PIPE)
    wait_until(lambda: finished(output) >= 3, "three rows")
    started = children(running.pid)
    running.send_signal(by)
    _, said = running.communicate()
    status = {signal.SIGKILL: -9, signal.SIGINT: 130}[by]
    assert running.returncode == status, said
    assert b"Traceback" not in said
    assert (b"--resume goes on" in said) == (by != signal.SIGKILL)
    wait_until(lambda: not any(map(is_running, started)), "the end of its processes")
    kept = finished(output)
    assert 3 <= kept < ROWS
    assert not output.exists()
    ended = subprocess.run([*words, "--resume"], check=True, stderr=subprocess.PIPE)
    assert b"12 of 12" in ended.stderr
    assert output.read_bytes() == expected


class OneQuickPart(Struct, frozen=True):
    """A job whose first part is over at once, and whose others say when they are over."""

    folder: Path
    ballast: bytes = b""

    def run(self, number: int) -> int:
        """Wait, but in the first part."""
        if number > 0:
            Event().wait(60.0)
            (self.folder / str(number)).touch()
        return number

    def lost(self, number: int, why: str) -> int:
        """Raise what the test is to show."""
        raise AssertionError(number, why)


@pytest.mark.slow
@pytest.mark.parametrize("ballast", [b"", bytes(1 << 20)], ids=["small", "more than a pipe takes"])
def test_parts_under_way_are_not_waited_for_by_one_who_takes_no_more(
    tmp_path: Path, ballast: bytes
) -> None:
    with closing(run_here(OneQuickPart(tmp_path, ballast), range(4), 2)) as parts:
        assert next(parts) == 0
    assert [*tmp_path.iterdir()] == []


UNGUARDED = """
from pathlib import Path
from firmware_runtime.lab.sweeps.local_pool import run_here
from tests.sweeps.test_lost_processes import OneQuickPart

print([*run_here(OneQuickPart(Path()), range(4), 2)])
"""


@pytest.mark.slow
def test_a_script_that_its_processes_would_run_again_is_told_so(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(UNGUARDED)
    ended = subprocess.run(
        [sys.executable, script],
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 1
    last = ended.stderr.splitlines()[-1]
    assert "workers: none of its processes could begin; expected in a script a call below" in last


def is_running(process: int) -> bool:
    """Whether a process is there and has not ended."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.slow
def test_a_process_that_is_killed_costs_its_rows_under_way(tmp_path: Path, expected: bytes) -> None:
    output, killed = tmp_path / "table.csv", []

    def kill_one(done: int, _size: int, _failed: int) -> None:
        if done == 3:
            workers = [each for each in children(os.getpid()) if b"spawn_main" in command_of(each)]
            killed.append(workers[0])
            os.kill(workers[0], signal.SIGKILL)

    carry_out(SHORT, output, workers=2, progress=kill_one)
    assert killed
    assert output.read_bytes() == expected


def command_of(process: int) -> bytes:
    """The words that a process was started with."""
    return Path(f"/proc/{process}/cmdline").read_bytes()


@pytest.mark.slow
def test_a_cluster_that_loses_a_worker_makes_the_same_table(
    tmp_path: Path, expected: bytes
) -> None:
    output = tmp_path / "table.csv"
    with cluster(tmp_path, workers=2) as (address, workers):
        words = [*COMMAND, "--scheduler", address, "-o", str(output)]
        running = subprocess.Popen(words, stderr=subprocess.PIPE)
        wait_until(lambda: finished(output) >= 4, "four rows")
        workers[0].kill()
        _, said = running.communicate()
        assert running.returncode == 0, said
    assert output.read_bytes() == expected


@pytest.mark.slow
def test_a_cluster_that_loses_all_its_workers_is_not_waited_for_without_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("firmware_runtime.lab.sweeps.cluster.LOOK_S", 0.2)
    output = tmp_path / "table.csv"
    with cluster(tmp_path, workers=1) as (address, workers):

        def kill(_done: int, _size: int, _failed: int) -> None:
            workers[0].kill()

        with pytest.raises(ConfigError, match=r"has had no workers for .* see --resume"):
            carry_out(SHORT, output, scheduler=address, progress=kill)
    assert 1 <= finished(output) < ROWS
    assert not output.exists()


@pytest.mark.slow
def test_a_result_that_is_lost_with_its_worker_before_it_is_fetched_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("firmware_runtime.lab.sweeps.cluster.LOOK_S", 0.2)
    fetched = sweeps_cluster._fetched
    with cluster(tmp_path, workers=1) as (address, workers):

        def fetched_too_late(future: object) -> SimpleQueue[Row | Exception]:
            workers[0].kill()
            workers[0].wait()
            return fetched(future)

        monkeypatch.setattr(sweeps_cluster, "_fetched", fetched_too_late)
        with pytest.raises(ConfigError, match="has had no workers for"):
            carry_out(SHORT, tmp_path / "table.csv", scheduler=address)


@pytest.mark.slow
def test_a_scheduler_that_is_not_there_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("firmware_runtime.lab.sweeps.cluster.CONNECT_S", 1.0)
    for address in ("tcp://127.0.0.1:1", "nonsense://x"):
        with pytest.raises(ConfigError, match="expected the address of a scheduler"):
            sweep("tachobot", SHORT.vary, scheduler=address)
