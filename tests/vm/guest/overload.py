"""A run that cannot keep up: the machine stays usable, beside one that goes on and one that dies.

TachoBot's period is set to 2 ms where a step takes 8 to 80, at SCHED_FIFO 60 as shipped.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from tests.vm.guest.login import log_in, visitor
from tests.vm.guest.machine import PROGRAM, attempt, expect, run, wait_until
from tests.vm.guest.report import Check
from tests.vm.guest.service import TACHOBOT

LOGIN_S: Final = 10.0
SLOWER: Final = 10.0
"""How many times as long as beside an idle service a login may take, where that is more."""
LOGINS: Final = 3
STARTS: Final = 2
PATIENCE_S: Final = 300.0
HOPELESS: Final = {
    "controller.period_s": 0.002,
    "imu.sample_hz": 1000,
    "executive.max_load_percent": 60.0,
    "executive.watchdog_s": 60.0,
    "guard.stall_s": 10.0,
}
"""A step that finds no new sample is one transaction: still longer than the period. One that brings
the sensor up again can take seconds here; neither guard nor watchdog is what is looked at."""


def a_login_is_answered_beside_a_hopelessly_overloaded_run() -> str:
    """From its start on; it goes on without real-time priority, and says so."""
    with _hopeless("skip") as limit_s:
        said = _logins(limit_s)
        wait_until(_is_overloaded, "statistics say that it is overloaded", PATIENCE_S)
        seen = run("chrt", "--pid", str(TACHOBOT.pid()))
        expect("SCHED_OTHER" in seen, f"it did not give up its priority: {seen}")
        reported = run(
            "journalctl", "-b", "--no-pager", "--grep=overload: ", "-u", TACHOBOT.runtime
        )
        refused = attempt(PROGRAM, "arm", TACHOBOT.board)
        expect(refused.returncode == 5, f"arm ended with {refused.returncode}, expected 5")
        expect("given up" in refused.stderr, refused.stderr)
        return f"{said}; {reported.strip().splitlines()[-1].rpartition('firmware-runtime: ')[2]}"


def a_login_is_answered_beside_a_run_that_dies_of_overload_again_and_again() -> str:
    """Each start fails as logical time does not keep up; the next one waits longer."""
    with _hopeless("catch-up") as limit_s:
        wait_until(lambda: _failed_starts() >= STARTS, "some starts have failed", PATIENCE_S)
        said = _logins(limit_s)
        expect(TACHOBOT.is_off(), "an output is on")
        guard = TACHOBOT.shown("ActiveState", TACHOBOT.guard)
        expect(guard == "active", f"its guard is {guard}")
        shown = attempt(PROGRAM, "service", "status", TACHOBOT.board).stdout
        reported = [line.strip() for line in shown.splitlines() if "failed in a row" in line]
        expect(reported, f"service status does not say how often it failed: {shown}")
        return f"{said}; {reported[0]}"


@contextmanager
def _hopeless(policy: str) -> Iterator[float]:
    """TachoBot without a chance, from its start on; as it was afterwards.

    Yields how long a login may take, s.
    """
    before = TACHOBOT.settings.read_bytes()
    with visitor():
        limit_s = max(LOGIN_S, SLOWER * log_in())
        try:
            TACHOBOT.change({**HOPELESS, "overruns.imu.policy": policy})
            _take_up_settings()
            yield limit_s
        finally:
            TACHOBOT.settings.write_bytes(before)
            _take_up_settings()
            TACHOBOT.wait_until_active()


def _take_up_settings() -> None:
    """The watchdog's time is in the unit's drop-in."""
    run(PROGRAM, "service", "install", TACHOBOT.board, "--no-start")
    run("systemctl", "--no-block", "restart", TACHOBOT.guard, TACHOBOT.runtime)


def _logins(limit_s: float) -> str:
    """Log in several times in a row, each within its time."""
    took_s = [log_in() for _ in range(LOGINS)]
    said = f"logins took {', '.join(f'{each:.1f}' for each in took_s)} s of {limit_s:.1f}"
    expect(max(took_s) <= limit_s, f"{said}, expected no more than that")
    return said


def _is_overloaded() -> bool:
    shown = attempt(PROGRAM, "stats", TACHOBOT.board, "--json")
    if shown.returncode != 0:  # the run is only coming up
        return False
    statistics = json.loads(shown.stdout)
    return statistics["conditions"]["run"]["overloaded_s"] is not None


def _failed_starts() -> int:
    shown = attempt(PROGRAM, "service", "status", TACHOBOT.board, "--json")
    found: int = json.loads(shown.stdout)["boards"][TACHOBOT.board]["failed_starts"]
    return found


CHECKS: Final[tuple[Check, ...]] = (
    a_login_is_answered_beside_a_hopelessly_overloaded_run,
    a_login_is_answered_beside_a_run_that_dies_of_overload_again_and_again,
)
