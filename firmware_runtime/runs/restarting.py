"""Starts of a service, one after the other: the next one waits, and logs for how long."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from firmware_runtime.devs.time import SECOND
from firmware_runtime.errors import ConfigError, StatisticsFileError, Status
from firmware_runtime.runs.restarts import Restarts
from firmware_runtime.system.messages import Notices
from firmware_runtime.system.signals import until_signal

_GOOD = {Status.OK, Status.BAD_INPUT, Status.INTERRUPTED, Status.TERMINATED, Status.NOT_PRINTED}
"""No start that failed: as requested, or not to be fixed by another start."""


def counted(
    run: Callable[[Restarts | None], int],
    statistics: Path | None,
    notices: Notices,
    within: int,
    meanwhile: str = "outputs are off",
) -> int:
    """Run where a manager starts it again and again: wait if the last starts failed, and count.

    `within` is how long the start may take after the wait, ns; `meanwhile` is what holds during
    the wait. SIGTERM ends it.
    """
    if statistics is None or not notices.is_there:
        return run(None)
    restarts = Restarts(statistics)
    if _is_stopped(restarts, notices, within, meanwhile):
        _forget(restarts)
        return Status.TERMINATED
    return _counted(run, restarts)


def _counted(run: Callable[[Restarts | None], int], restarts: Restarts) -> int:
    """Run, and forget the starts that failed if this one did not."""
    with suppress(OSError):  # no place for statistics either: the run says so itself
        restarts.begin()
    try:
        status = run(restarts)
    except (ConfigError, StatisticsFileError):
        _forget(restarts)
        raise
    if status in _GOOD:
        _forget(restarts)
    return status


def _is_stopped(restarts: Restarts, notices: Notices, within: int, meanwhile: str) -> bool:
    """Wait as long as this start must; whether a signal came meanwhile."""
    if restarts.wait == 0:
        return False
    wait_s = restarts.wait / SECOND
    said = f"the last {restarts.failed} starts failed: waits {wait_s:g} s, {meanwhile}"
    with until_signal() as signal:
        notices.progress(said, restarts.wait + within)
        return signal.wait(wait_s)


def _forget(restarts: Restarts) -> None:
    with suppress(OSError):
        restarts.forget()
