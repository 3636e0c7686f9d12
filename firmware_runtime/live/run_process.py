"""The process of a run on doubles, stalled for a moment or killed, to see what becomes of it.

Only of a run that says in its statistics that it drives doubles: on chips both are refused.
"""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from firmware_runtime.errors import ConfigError, StatisticsFileError, text_of
from firmware_runtime.statistics.file_header import STATISTICS, Driver, driver_of
from firmware_runtime.system.this_process import is_running
from firmware_runtime.system.this_system import demand_linux

LONGEST_S: Final = 2.0
_BEGINS_WITHIN_S: Final = 10.0
_OVER: Final = "the run is over; expected one under way"
_MODULE: Final = "firmware_runtime.live.stalling"


def stall(run: Path, for_s: float) -> None:
    """Stop the run with these statistics for so long; return when it goes on.

    It goes on also where this process dies meanwhile. Raises ConfigError.
    """
    if not 0.0 < for_s <= LONGEST_S:
        raise ConfigError.of_one(
            "stall", f"{for_s!r} s", expected=f"above 0, {LONGEST_S:g} at most"
        )
    with _process_of(run, "stall") as process:
        words = [sys.executable, "-P", "-m", _MODULE, str(process), repr(float(for_s))]
        child = subprocess.Popen(  # noqa: S603 -- our own program
            words, pass_fds=[process], start_new_session=True
        )
        try:
            child.wait(for_s + _BEGINS_WITHIN_S)
        except BaseException:
            child.kill()
            child.wait()
            raise
        finally:
            _go_on(process)


def kill(run: Path) -> None:
    """Kill the run with these statistics, which is on served doubles. Raises ConfigError."""
    with _process_of(run, "kill", is_served=True) as process:
        signal.pidfd_send_signal(process, signal.SIGKILL)


@contextmanager
def _process_of(run: Path, where: str, *, is_served: bool = False) -> Iterator[int]:
    """A descriptor of the run's process, open, which Linux alone has.

    Raises ConfigError for one on chips, or over.
    """
    demand_linux(where)
    try:
        with STATISTICS.opened(run) as file:
            driver = driver_of(file)
    except StatisticsFileError as error:
        raise ConfigError.of_one(where, text_of(error)) from error
    if (fault := _why_not(driver, is_served=is_served)) is not None:
        raise ConfigError.of_one(where, fault)
    try:
        process = os.pidfd_open(driver.writer.pid)
    except OSError as error:
        raise ConfigError.of_one(where, _OVER) from error
    try:
        if driver.saved is not None or not is_running(driver.writer):
            raise ConfigError.of_one(where, _OVER)
        yield process
    except PermissionError as error:
        fault = "the run is another user's; expected one of this user's"
        raise ConfigError.of_one(where, fault) from error
    except ProcessLookupError as error:
        raise ConfigError.of_one(where, _OVER) from error
    finally:
        os.close(process)


def _why_not(driver: Driver, *, is_served: bool) -> str | None:
    doubles = driver.conditions.get("doubles")
    if doubles is None:
        return "the run does not say that it is on doubles; expected one with --doubles"
    if is_served and not isinstance(doubles, str):
        return "its doubles are in the run itself; expected doubles that are served"
    return None


def _go_on(process: int) -> None:
    with suppress(ProcessLookupError):
        signal.pidfd_send_signal(process, signal.SIGCONT)
