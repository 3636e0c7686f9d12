"""TachoBot armed for as long as ARMED_MINUTES says, with other load beside it.

Opening a bus sets the adapter's timeout, which is the matter here: all that open this one set the
same. A panic of the kernel ends the computer, and is on its console.
"""

import json
from time import monotonic
from typing import Any, Final

from tests.pi.guest.emulated import (
    MINUTES,
    may_drive,
    program,
    started,
    tried,
    write_settings,
)
from tests.pi.guest.tachobot import robot
from tests.vm.guest.machine import expect, run
from tests.vm.guest.report import Check, say

LOAD: Final = ("while :; do :; done", "while :; do cat /proc/stat >/dev/null; done")
LOOK_S: Final = 20
SAID_EVERY: Final = 6
LONGEST: Final = 2.5
"""Times as long as it was to be armed, after which it is given up."""


def tachobot_is_armed_beside_other_load() -> None:
    """Guard and run, and programs that never rest."""
    write_settings("tachobot")
    for number, load in enumerate(LOAD):
        started("sh", "-c", load, log=f"load{number}")
    robot.start()
    robot.arm()


def it_stays_up_for_its_time_armed() -> str:
    """It is armed again where it was not."""
    armed_s, looks, rearmed = 0.0, 0, 0
    wanted_s = float(MINUTES or "30") * 60
    began_at = looked_at = monotonic()
    was_armed = True
    while armed_s < wanted_s:
        run("sleep", LOOK_S)
        shown, now = robot.statistics(), monotonic()
        is_armed = bool(shown) and bool(shown["conditions"]["run"]["armed"])
        if was_armed and is_armed:
            armed_s += now - looked_at
        elif shown:
            rearmed += tried("arm", "tachobot").returncode == 0
        was_armed, looked_at = is_armed, now
        looks += 1
        if looks % SAID_EVERY == 0:
            say(f"# {armed_s / 60:.1f} min armed; {_figures(shown)}")
        expect(
            now - began_at < LONGEST * wanted_s,
            f"armed for {armed_s / 60:.1f} min of {(now - began_at) / 60:.1f}, {rearmed} times",
        )
    return (
        f"{armed_s / 60:.1f} min armed of {(monotonic() - began_at) / 60:.1f}, armed again "
        f"{rearmed} times; {_figures(robot.statistics())}"
    )


def it_is_disarmed_and_made_safe() -> str:
    """What was sent meanwhile the host's watch has."""
    program("disarm", "tachobot")
    said = program("safe-state", robot.settings)
    may_drive(outputs=False)
    return said.strip()


def _figures(shown: dict[str, Any]) -> str:
    if not shown:
        return "no statistics"
    bus = shown["bus"]["i2c1"]
    return (
        f"{shown['run']} of {shown['scheduled']} activations, {bus['transactions']} transactions, "
        f"{bus['errors']} errors, {bus['retries']} retries; faults "
        f"{json.dumps(shown['faults'])[:500]}"
    )


CHECKS: Final[tuple[Check, ...]] = (
    tachobot_is_armed_beside_other_load,
    it_stays_up_for_its_time_armed,
    it_is_disarmed_and_made_safe,
)
