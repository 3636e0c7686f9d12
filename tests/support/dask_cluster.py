"""A scheduler of Dask and workers, real processes on this machine, for tests."""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.support.waiting import wait_until

Process = subprocess.Popen[bytes]
_LOCAL = ("--no-dashboard", "--host", "127.0.0.1")


@contextmanager
def cluster(folder: Path, workers: int) -> Iterator[tuple[str, list[Process]]]:
    """The scheduler's address and its workers, one thread each; all have ended after the block."""
    told = folder / "scheduler.json"
    started = [_start("dask_scheduler", "--port", "0", "--scheduler-file", str(told), *_LOCAL)]
    try:
        wait_until(told.exists, "the scheduler's file")
        address = json.loads(told.read_text())["address"]
        for number in range(workers):
            place = ("--local-directory", str(folder / f"worker-{number}"))
            words = (address, "--nthreads", "1", "--no-nanny", *place, *_LOCAL)
            started.append(_start("dask_worker", *words))
        yield address, started[1:]
    finally:
        for process in started:
            process.kill()
            process.wait()


def _start(program: str, *words: str) -> Process:
    command = [sys.executable, "-m", f"distributed.cli.{program}", *words]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
