"""A scheduler of Dask and workers, real processes on this machine, for tests."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from distributed import Client

from tests.support.waiting import PATIENCE_S, wait_until

Process = subprocess.Popen[bytes]
_LOCAL = ("--no-dashboard", "--host", "127.0.0.1")


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[Process]]]:
    """The scheduler's address and its workers, one thread each; all have ended after the block.

    All workers are there: a sweep waits for the first one as long as its user would.
    """
    told = folder / "scheduler.json"
    started = [_start("dask_scheduler", "--port", "0", "--scheduler-file", str(told), *_LOCAL)]
    try:
        wait_until(lambda: _address(told) != "", "the scheduler's file")
        address = _address(told)
        for number in range(workers):
            place = ("--local-directory", str(folder / f"worker-{number}"))
            words = (address, "--nthreads", "1", "--no-nanny", *place, *_LOCAL)
            started.append(_start("dask_worker", *words))
        with Client(address, timeout=PATIENCE_S, set_as_default=False) as client:  # type: ignore[no-untyped-call]
            client.wait_for_workers(workers, timeout=PATIENCE_S)
        yield address, started[1:]
    finally:
        for process in started:
            process.kill()
            process.wait()


def _address(told: Path) -> str:
    """What the scheduler's file says; none while it is not there, or not yet whole."""
    try:
        found: str = json.loads(told.read_text())["address"]
    except (FileNotFoundError, ValueError):
        return ""
    return found


def _start(program: str, *words: str) -> Process:
    command = [sys.executable, "-m", f"distributed.cli.{program}", *words]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
