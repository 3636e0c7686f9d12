"""Rows on this machine's cores: processes of their own, started fresh and ended with this one.

A process that is killed costs the rows under way, which are run again by new ones; a row that was
under way three times when that happened is given up.
"""

import multiprocessing
import os
import signal
import threading
from collections import Counter
from collections.abc import Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import wait as wait_for
from typing import Final

from firmware_runtime.errors import Status
from firmware_runtime.lab.sweeps.plan import Sweep
from firmware_runtime.lab.sweeps.row import Row, lost, run_row
from firmware_runtime.system.this_system import allowed_cpus

MOST_LOSSES: Final = 3
_AHEAD: Final = 2
"""Rows that wait for each process, so that none waits for a row."""


def cores() -> int:
    """Count the processes that this one may keep busy."""
    return len(allowed_cpus())


def run_here(sweep: Sweep, rows: Sequence[int], workers: int) -> Generator[Row, None, None]:
    """Run rows and yield each as it ends, in any order; with one worker in this process."""
    if workers == 1 or len(rows) == 1:
        yield from (run_row(sweep, row) for row in rows)
        return
    left, losses = list(rows), Counter[int]()
    while left:
        done = set()
        for row in _run_by_pool(sweep, left, workers, losses):
            done.add(row["row"])
            yield row
        left = [each for each in left if each not in done]
        for number in [each for each in left if losses[each] >= MOST_LOSSES]:
            left.remove(number)
            yield lost(sweep, number, f"its process was killed, {MOST_LOSSES} times")


def _run_by_pool(
    sweep: Sweep, rows: Sequence[int], workers: int, losses: Counter[int]
) -> Generator[Row, None, None]:
    """Yield what ends before a process is killed; count the rows that were under way then."""
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(workers, len(rows)), context, initializer=_begin)
    waiting: dict[Future[Row], int] = {}
    to_come = iter(rows)
    try:
        while True:
            while len(waiting) < _AHEAD * workers and (row := next(to_come, None)) is not None:
                waiting[pool.submit(_row, sweep, row)] = row
            if not waiting:
                return
            ended, _ = wait(waiting, return_when=FIRST_COMPLETED)
            for future in ended:
                yield future.result()
                del waiting[future]
    except BrokenProcessPool:
        losses.update(waiting.values())
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _begin() -> None:
    """In a process of the pool: its parent sees to Ctrl-C, and it ends with its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _row(sweep: Sweep, row: int) -> Row:
    """Run a row in a process of the pool; a signal that ends the run ends the process.

    To the pool what it raises would be an answer, and the process would wait for the next row.
    """
    try:
        return run_row(sweep, row)
    except SystemExit as signalled:
        os._exit(signalled.code if isinstance(signalled.code, int) else Status.MODEL_ERROR)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait_for([parent.sentinel])
        os._exit(1)
