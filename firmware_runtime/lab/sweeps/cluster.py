"""Jobs on a cluster: the same parts, sent through a scheduler of Dask distributed.

A worker that is lost costs the parts under way there; the scheduler has others run them. Workers
need this project, the board's package, and for a board by path that file at the same place.
"""

import re
from collections.abc import Generator, Sequence
from queue import Empty, SimpleQueue
from threading import Thread
from types import ModuleType
from typing import Any, Final, TypeAlias, TypeVar

from firmware_runtime.errors import ConfigError
from firmware_runtime.lab.sweeps.local_pool import Job
from firmware_runtime.system.packages import module_of_extra

T = TypeVar("T")
Client: TypeAlias = Any
"""distributed has no types."""
CONNECT_S: Final = 10.0
LOOK_S: Final = 5.0
"""Time without a result, s, after which the cluster is asked for its workers."""
_LOOKS: Final = 12
"""A cluster that has lost all of them is waited for so often."""
_AHEAD: Final = 4
"""Parts that wait for each thread of the cluster."""


def run_on_cluster(job: Job[T], numbers: Sequence[int], address: str) -> Generator[T, None, None]:
    """Run parts and yield each as it ends, in any order. Raises ConfigError without a scheduler."""
    distributed = module_of_extra("distributed", "sweep")
    with _client(distributed, address) as client:
        yield from _parts(distributed, client, job, numbers)


def _client(distributed: ModuleType, address: str) -> Client:
    try:
        if not re.search(r":[0-9]+$", address):  # distributed would say so much later, untidily
            raise ValueError(address)  # noqa: TRY301
        return distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        expected = "expected the address of a scheduler of Dask, such as tcp://10.0.0.1:8786"
        fault = f"{address}: cannot be reached; {expected}"
        raise ConfigError.of_one("--scheduler", fault) from error


def _parts(
    distributed: ModuleType, client: Client, job: Job[T], numbers: Sequence[int]
) -> Generator[T, None, None]:
    to_come, under_way = iter(numbers), {}
    ended: SimpleQueue[Client] = SimpleQueue()

    def send() -> bool:
        number = next(to_come, None)
        if number is None:
            return False
        future = client.submit(job.run, number, pure=False)
        under_way[future.key] = number, future
        future.add_done_callback(ended.put)
        return True

    for _ in range(_AHEAD * _threads(client)):
        if not send():
            break
    while under_way:
        future = _next(client, ended)
        number, _ = under_way.pop(future.key)
        found = _next(client, _fetched(future))
        if isinstance(found, Exception):
            found = _failed(distributed, found, job, number)
        yield found
        send()


def _fetched(future: Client) -> "SimpleQueue[Any]":
    """Return a queue that gets a part's result, or why there is none.

    One whose worker is lost before it is fetched is run again by another, however long there is
    none, and distributed waits for that without end: in a thread, so that `_next` can give up.
    """
    found: SimpleQueue[Any] = SimpleQueue()

    def fetch() -> None:
        try:
            found.put(future.result())
        except Exception as error:  # noqa: BLE001 -- told apart by `_failed`
            found.put(error)

    Thread(target=fetch, daemon=True).start()
    return found


def _next(client: Client, queue: "SimpleQueue[T]") -> T:
    """Take from a queue. Raises ConfigError if there has been no worker for a minute."""
    looks = 0
    while looks < _LOOKS:
        try:
            return queue.get(timeout=LOOK_S)
        except Empty:
            looks = 0 if _has_workers(client) else looks + 1
    fault = f"{client.scheduler.address} has had no workers for {LOOK_S * _LOOKS:g} s"
    raise ConfigError.of_one("--scheduler", f"{fault}; finished rows are kept, see --resume")


def _threads(client: Client) -> int:
    """Count the parts that the cluster can run at once. Raises ConfigError if it stays none."""
    try:
        client.wait_for_workers(1, timeout=CONNECT_S)
    except TimeoutError as error:
        fault = f"{client.scheduler.address} has no workers; expected one or more"
        raise ConfigError.of_one("--scheduler", fault) from error
    threads: int = sum(client.nthreads().values())
    return max(threads, 1)


def _has_workers(client: Client) -> bool:
    try:
        return bool(client.nthreads())
    except OSError as error:
        raise _scheduler_lost() from error


def _scheduler_lost() -> ConfigError:
    fault = "the scheduler was lost; finished rows are kept, see --resume"
    return ConfigError.of_one("--scheduler", fault)


def _failed(distributed: ModuleType, error: Exception, job: Job[T], number: int) -> T:
    """Return what stands for a part without a result. Raises ConfigError where it cannot go on.

    One that was under way on several workers that were lost is given up.
    """
    if isinstance(error, distributed.scheduler.KilledWorker):
        return job.lost(number, "the workers that ran it were lost")
    if isinstance(error, distributed.CancelledError | OSError):
        raise _scheduler_lost() from error
    # not of the part: it raises nothing
    fault = f"a worker cannot run a part: {type(error).__name__}: {error}"
    expected = "expected this version of the project and the board's package there"
    raise ConfigError.of_one("--scheduler", f"{fault}; {expected}") from error
