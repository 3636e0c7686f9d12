"""A reboot, and what is left when the service is removed."""

import json
import sys
from typing import Final

from tests.vm.guest.machine import PROGRAM, attempt, expect, run, wait_until
from tests.vm.guest.report import Check, say
from tests.vm.guest.service import BEFORE, DETECTIVE, TACHOBOT, files

ALLOWED: Final = (
    "/etc/group-",
    "/etc/passwd-",
    "/etc/gshadow-",
    "/etc/shadow-",
    "/etc/subgid",
    "/etc/subuid",
    "/var/lib/systemd",
    "/var/lib/private",
    "/var/lib/vm-checks",
    "/etc/machine-id",
)
"""What systemd and shadow keep of their own."""


def reboot() -> None:
    """Not a check: ends this boot. The next one goes on behind it."""
    say("# reboots")
    run("systemctl", "reboot")
    sys.exit(0)


def after_a_reboot_it_is_active_and_disarmed() -> str:
    """`at_start = false`, the board's own setting."""
    TACHOBOT.wait_until_active()
    DETECTIVE.wait_until_active()
    expect(not TACHOBOT.is_armed(), "it is armed")
    expect(TACHOBOT.is_off(), "an output is on")
    TACHOBOT.change({"arming.at_start": True})
    return TACHOBOT.shown("StatusText")


def after_a_reboot_it_is_armed_where_the_board_says_so() -> str:
    """`at_start = true`, as soon as nothing speaks against it."""
    TACHOBOT.wait_until_active()
    wait_until(TACHOBOT.is_armed, "armed")
    wait_until(lambda: not TACHOBOT.is_off(), "an output is on")
    return TACHOBOT.shown("StatusText")


def what_the_unit_has_recorded_is_its_replay() -> str:
    """A run on a real `/dev/i2c-N`, under its sandbox, while it goes on."""
    done = attempt(PROGRAM, "replay", "tachobot", "--until", "20", "--json", timeout_s=600.0)
    expect(bool(done.stdout), done.stderr)
    said = json.loads(done.stdout)
    expect(said["identical"], f"{said['first_difference']}, {said['faults']}")
    return f"{said['steps']} steps, {said['events']} values, {said['transfers']} transfers"


def stopping_the_unit_switches_off() -> str:
    """As at shutdown."""
    run("systemctl", "stop", TACHOBOT.runtime)
    expect(TACHOBOT.is_off(), "an output is on after the unit has stopped")
    return f"result {TACHOBOT.shown('Result')}"


def uninstall_leaves_nothing() -> str:
    """Both boards, with their settings; compared with the files there were before."""
    for robot in (DETECTIVE, TACHOBOT):
        run(PROGRAM, "service", "uninstall", robot.board, "--purge")
    before = set(BEFORE.read_text(encoding="utf-8").splitlines())
    left = [
        path for path in files().splitlines() if path not in before and not path.startswith(ALLOWED)
    ]
    expect(not left, f"left behind: {', '.join(left)}")
    units = run(
        "systemctl",
        "list-units",
        "--all",
        "--state=loaded",
        "--plain",
        "--no-legend",
        "firmware-runtime*",
    )
    expect(not units.strip(), f"units still loaded: {units}")
    expect(
        attempt("id", "firmware-runtime").returncode != 0,
        "the user firmware-runtime is still there",
    )
    return f"of {len(before)} files before, none more is there"


CHECKS: Final[tuple[Check, ...]] = (
    reboot,
    after_a_reboot_it_is_active_and_disarmed,
    reboot,
    after_a_reboot_it_is_armed_where_the_board_says_so,
    what_the_unit_has_recorded_is_its_replay,
    stopping_the_unit_switches_off,
    uninstall_leaves_nothing,
)
