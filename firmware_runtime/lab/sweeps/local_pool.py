"""Jobs on this machine's cores: processes of their own, started fresh and ended with this one.

A job has parts by number, such as the rows of a sweep. A process that is killed costs the parts
under way, which are run again by new ones; a part that was under way three times when that happened
is given up. Who takes no more of them does not wait for those under way, which may take minutes.
"""

import multiprocessing
import os
import signal
import threading
from collections import Counter
from collections.abc import Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import Connection
from multiprocessing.connection import wait as wait_for
from typing import Any, Final, Protocol, TypeVar

from firmware_runtime.errors import ConfigError, Status
from firmware_runtime.system.this_system import allowed_cpus

MOST_LOSSES: Final = 3
_AHEAD: Final = 2
"""Parts that wait for each process, so that none waits for a part."""
T = TypeVar("T")
T_co = TypeVar("T_co", covariant=True)


class Job(Protocol[T_co]):
    """Work in parts, which another process can do: it is sent there whole."""

    def run(self, number: int) -> T_co:
        """Do one part; raises nothing that the part could raise."""

    def lost(self, number: int, why: str) -> T_co:
        """Return what stands for a part whose process ended each time it was tried."""


_job: Job[object] | None = None
"""The job of this process, where it is one of a pool."""


def cores() -> int:
    """Count the processes that this one may keep busy."""
    return len(allowed_cpus())


def run_here(job: Job[T], numbers: Sequence[int], workers: int) -> Generator[T, None, None]:
    """Run parts and yield each as it ends, in any order; with one worker in this process.

    Raises ConfigError if none of its processes could begin.
    """
    if workers == 1 or len(numbers) == 1:
        yield from (job.run(number) for number in numbers)
        return
    left, losses = list(numbers), Counter[int]()
    while left:
        done = set()
        for number, found in _run_by_pool(job, left, workers, losses):
            done.add(number)
            yield found
        left = [each for each in left if each not in done]
        for number in [each for each in left if losses[each] >= MOST_LOSSES]:
            left.remove(number)
            yield job.lost(number, f"its process was killed, {MOST_LOSSES} times")


def _run_by_pool(
    job: Job[T], numbers: Sequence[int], workers: int, losses: Counter[int]
) -> Generator[tuple[int, T], None, None]:
    """Yield what ends before a process is killed; count the parts that were under way then."""
    context = multiprocessing.get_context("spawn")
    goes_on, own_end = context.Pipe(duplex=False)
    begun, says_so = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(
        min(workers, len(numbers)), context, initializer=_begin, initargs=(goes_on, says_so, job)
    )
    waiting: dict[Future[Any], int] = {}
    to_come = iter(numbers)
    try:
        while True:
            while len(waiting) < _AHEAD * workers and (part := next(to_come, None)) is not None:
                waiting[pool.submit(_run, part)] = part
            if not waiting:
                return
            ended, _ = wait(waiting, return_when=FIRST_COMPLETED)
            for future in ended:
                yield waiting[future], future.result()
                del waiting[future]
    except BrokenProcessPool as error:
        if not begun.poll():
            raise _none_begins() from error
        losses.update(waiting.values())
    finally:
        if waiting:
            own_end.close()
        pool.shutdown(wait=True, cancel_futures=True)
        for end in (own_end, goes_on, begun, says_so):
            end.close()


def _none_begins() -> ConfigError:
    what = "none of its processes could begin"
    expected = 'in a script a call below `if __name__ == "__main__":`, or workers=1'
    return ConfigError.of_one("workers", what, expected)


def _begin(goes_on: Connection, says_so: Connection, job: Job[object]) -> None:
    """In a process of the pool: its parent sees to Ctrl-C, and it ends with it, or when told.

    The job comes once, not with each part: a large one would fill the pipe of parts, and the pool
    that writes into it would wait without end for processes that have ended.
    """
    global _job  # noqa: PLW0603 -- of a process of its own
    _job = job
    says_so.send_bytes(b"begun")
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, args=(goes_on,), daemon=True).start()


def _run(number: int) -> object:
    """Run a part in a process of the pool; a signal that ends the run ends the process.

    To the pool what it raises would be an answer, and the process would wait for the next part.
    """
    assert _job is not None  # noqa: S101 -- it has begun
    try:
        return _job.run(number)
    except SystemExit as signalled:
        os._exit(signalled.code if isinstance(signalled.code, int) else Status.MODEL_ERROR)


def _end_with_parent(goes_on: Connection) -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait_for([parent.sentinel, goes_on])
        os._exit(1)
