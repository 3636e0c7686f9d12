"""What a run leaves in the journal, and what a reload changes."""

import json
import signal
from itertools import pairwise
from select import select
from typing import Any, Final

from tests.vm.guest.machine import expect, run, wait_until
from tests.vm.guest.report import Check
from tests.vm.guest.robot import Robot
from tests.vm.guest.service import TACHOBOT

HANG_S: Final = 0.7
"""Longer than a period and the tolerance, shorter than the guard's patience."""
FIELDS: Final = ("MODEL", "PERIOD_US", "LATE_US", "MISSED", "CAUSE")


def entries(robot: Robot) -> list[dict[str, Any]]:
    """What the present run wrote to the journal, every field of it."""
    shown = run("journalctl", "-b", "--no-pager", "-o", "json", f"_PID={robot.pid()}")
    return [json.loads(line) for line in shown.splitlines()]


def a_reload_takes_up_a_changed_gain() -> str:
    """`systemctl reload`, without stopping."""
    pid = TACHOBOT.pid()
    TACHOBOT.change({"controller.yaw.kp": 0.5})
    run("systemctl", "reload", TACHOBOT.runtime)
    said: list[str] = []

    def is_reported() -> bool:
        said[:] = [each["MESSAGE"] for each in entries(TACHOBOT) if "reloaded" in each["MESSAGE"]]
        return bool(said)

    wait_until(is_reported, "the journal has the reload")
    expect("controller.yaw.kp" in said[-1], said[-1])
    expect(TACHOBOT.pid() == pid, "the run was started again")
    expect(TACHOBOT.shown("ActiveState") == "active", "the unit is not active")
    return said[-1]


def a_broken_file_changes_nothing() -> str:
    """The old settings stay in force."""
    sound = TACHOBOT.settings.read_bytes()
    TACHOBOT.change({"controller.yaw.kp": "much"})
    run("systemctl", "reload", TACHOBOT.runtime)
    wait_until(
        lambda: any("not reloaded" in each["MESSAGE"] for each in entries(TACHOBOT)),
        "the journal says that nothing was reloaded",
    )
    TACHOBOT.settings.write_bytes(sound)
    expect(TACHOBOT.shown("ActiveState") == "active", "the unit is not active")
    return "the run goes on"


def an_episode_of_overruns_is_one_entry_with_its_fields() -> str:
    """The run is stopped for a moment, too short for guard and watchdog.

    A host that is busy may make the guest late too, so what the journal says is held against what
    was counted.
    """
    before = _counted()
    TACHOBOT.signal_run(signal.SIGSTOP)
    select((), (), (), HANG_S)
    TACHOBOT.signal_run(signal.SIGCONT)
    wait_until(lambda: _counted() > before, "the statistics have the episode")
    # one may be under way again
    wait_until(
        lambda: 0 <= _counted() - _reported() <= 1 and _reported() > before,
        "the journal has the episodes that were counted",
    )
    found = _episodes()
    expect(len(found) <= _counted(), f"{len(found)} entries for {_counted()} episodes")
    expect(all(name in found[-1] for name in FIELDS), f"its fields are {sorted(found[-1])}")
    expect(found[-1]["PERIOD_US"] == "250000", f"PERIOD_US is {found[-1]['PERIOD_US']}")
    return ", ".join(f"{name}={found[-1][name]}" for name in FIELDS)


def the_journal_has_a_summary_a_minute_and_no_line_a_cycle() -> str:
    """Over everything the present run has written."""
    lines = entries(TACHOBOT)
    steps, messages = TACHOBOT.statistics()["run"], [each["MESSAGE"] for each in lines]
    at_s = [int(each["__MONOTONIC_TIMESTAMP"]) / 1e6 for each in lines if " Hz " in each["MESSAGE"]]
    apart = [later - earlier for earlier, later in pairwise(at_s)]
    expect(all(span > 50 for span in apart), f"summaries only {apart} s apart")
    expect(len(messages) < max(steps / 4, 20), f"{len(messages)} lines for {steps} cycles")
    return f"{len(messages)} lines for {steps} cycles"


def _episodes() -> list[dict[str, Any]]:
    return [each for each in entries(TACHOBOT) if "LATE_US" in each and "PERIOD_US" in each]


def _reported() -> int:
    """How many episodes the entries stand for."""
    return sum(int(each["EPISODES"]) for each in _episodes())


def _counted() -> int:
    models = TACHOBOT.statistics()["models"].values()
    return sum(each["episodes"] for each in models if each["kind"] == "periodic")


CHECKS: Final[tuple[Check, ...]] = (
    a_reload_takes_up_a_changed_gain,
    a_broken_file_changes_nothing,
    an_episode_of_overruns_is_one_entry_with_its_fields,
    the_journal_has_a_summary_a_minute_and_no_line_a_cycle,
)
