"""The service: installed for real, active under its sandbox, readable by its group only."""

import json
from pathlib import Path
from typing import Final

from tests.vm.guest.machine import PROGRAM, attempt, expect, run
from tests.vm.guest.report import Check
from tests.vm.guest.robot import Robot

TACHOBOT: Final = Robot("tachobot")
DETECTIVE: Final = Robot("detective")
BEFORE: Final = Path("/var/lib/vm-checks-files")
PLACES: Final = ("/etc", "/usr", "/var/lib", "/run/firmware-runtime")
SLOW_TACHOBOT: Final = {
    "controller.period_s": 0.25,
    "thrust_pairs.timeout_s": 2.0,
    "overruns.imu.tolerance_us": 200_000.0,
    "guard.stall_s": 1.0,
}
"""A step takes some 80 ms here: four transactions through an emulated machine."""
SLOW_DETECTIVE: Final = {
    "radar_sonar.period_s": 0.6,
    "body_sonar.period_s": 0.6,
    "radar_compass.period_s": 0.6,
    "body_compass.period_s": 0.6,
    "guard.stall_s": 10.0,
    "executive.watchdog_s": 60.0,
    "executive.max_lag_s": 10.0,
    "executive.max_load_percent": 100.0,
}
"""Its chips take 50 to 110 ms each here: on a busy host it is seconds behind, and goes on."""
SANDBOX: Final = {
    "NoNewPrivileges": "yes",
    "ProtectSystem": "strict",
    "ProtectHome": "yes",
    "DevicePolicy": "closed",
    "MemoryDenyWriteExecute": "yes",
    "CapabilityBoundingSet": "",
    "User": "firmware-runtime",
    "Type": "notify",
}


def files() -> str:
    """Every file, link and folder where a program could leave some, one a line."""
    there = [place for place in PLACES if Path(place).exists()]
    return "\n".join(sorted(run("find", *there, "-xdev").splitlines()))


def service_install_of_tachobot_starts_run_and_guard() -> str:
    """With the user's copy of the settings there before: it is kept."""
    BEFORE.write_text(files(), encoding="utf-8")
    TACHOBOT.write_settings(SLOW_TACHOBOT)
    mine = TACHOBOT.settings.read_bytes()
    run(PROGRAM, "service", "install", "tachobot")
    TACHOBOT.wait_until_active()
    expect(TACHOBOT.settings.read_bytes() == mine, "the user's copy of the settings was changed")
    return TACHOBOT.shown("StatusText")


def the_unit_runs_under_its_whole_sandbox() -> str:
    """As systemd has it, and as the kernel sees the process."""
    for name, value in SANDBOX.items():
        shown = TACHOBOT.shown(name)
        expect(shown == value, f"{name} is {shown!r}, expected {value!r}")
    status = Path(f"/proc/{TACHOBOT.pid()}/status").read_text(encoding="ascii")
    facts = dict(line.split(":\t", 1) for line in status.splitlines() if ":\t" in line)
    for name, fact in {"CapEff": "0" * 16, "NoNewPrivs": "1", "Seccomp": "2"}.items():
        expect(facts[name] == fact, f"{name} of the process is {facts[name]}, expected {fact}")
    expect(not facts["Uid"].startswith("0\t"), "the process runs as root")
    return f"user {facts['Uid'].split()[0]}, Seccomp 2, no capability"


def the_sandbox_is_rated_below_2() -> str:
    """By `systemd-analyze security`, of the unit as it is loaded."""
    rated = run("systemd-analyze", "security", "--no-pager", "--threshold=20", TACHOBOT.runtime)
    return rated.strip().splitlines()[-1].lstrip("→ ")


def the_run_has_the_fifo_priority_it_asked_for() -> str:
    """By the kernel, by its own statistics, and so for the guard, one above."""
    seen = run("chrt", "--pid", str(TACHOBOT.pid()))
    expect("SCHED_FIFO" in seen, seen)
    expect("priority: 60" in seen, seen)
    guards = run("chrt", "--pid", str(TACHOBOT.pid(TACHOBOT.guard)))
    expect("priority: 61" in guards, guards)
    settings = TACHOBOT.statistics()["conditions"]["settings"]
    refused = {
        name: each for name, each in settings.items() if each["asked"] and not each["granted"]
    }
    expect(settings["fifo_priority"]["granted"], f"not granted: {settings['fifo_priority']}")
    return f"not granted: {json.dumps(refused)}" if refused else "all that was asked for is granted"


def statistics_are_read_by_the_group_and_by_no_others() -> str:
    """Two ordinary users, one of them a member."""
    for user in ("member", "stranger"):
        run("useradd", user)
    run("usermod", "--append", "--groups", "firmware-runtime", "member")
    read = ("runuser", "-u", "member", "--", PROGRAM, "stats", "tachobot", "--json")
    expect(json.loads(run(*read))["run"] > 0, "the member reads no activations")
    refused = attempt("runuser", "-u", "stranger", "--", PROGRAM, "stats", "tachobot")
    expect(refused.returncode == 2, f"the stranger got {refused.returncode}: {refused.stdout}")
    expect("group" in refused.stderr, f"no hint at the group: {refused.stderr}")
    for user in ("member", "stranger"):
        run("userdel", user)
    return refused.stderr.strip()


def a_second_run_on_the_same_bus_is_refused() -> str:
    """Also to root."""
    words = ("env", "FIRMWARE_RUNTIME_STATE_DIRECTORY=/tmp", PROGRAM, "run", TACHOBOT.settings)
    refused = attempt(*words, "--for", "1")
    expect(refused.returncode == 3, f"it ended with {refused.returncode}: {refused.stderr}")
    expect("another process" in refused.stderr, refused.stderr)
    return refused.stderr.strip()


def service_install_of_detective_runs_beside_it() -> str:
    """The other board, on its own bus."""
    DETECTIVE.write_settings(SLOW_DETECTIVE)
    run(PROGRAM, "service", "install", "detective")
    DETECTIVE.wait_until_active()
    expect("SCHED_FIFO" in run("chrt", "--pid", str(DETECTIVE.pid())), "no SCHED_FIFO")
    expect(TACHOBOT.shown("ActiveState") == "active", "tachobot is not active any more")
    return DETECTIVE.shown("StatusText")


def both_boards_are_in_service_status() -> None:
    """Machine-readable, exit status 0."""
    shown = json.loads(run(PROGRAM, "service", "status", "--json"))
    expect(set(shown["boards"]) == {"tachobot", "detective"}, f"it shows {shown}")


CHECKS: Final[tuple[Check, ...]] = (
    service_install_of_tachobot_starts_run_and_guard,
    the_unit_runs_under_its_whole_sandbox,
    the_sandbox_is_rated_below_2,
    the_run_has_the_fifo_priority_it_asked_for,
    statistics_are_read_by_the_group_and_by_no_others,
    a_second_run_on_the_same_bus_is_refused,
)
TWO_ROBOTS: Final[tuple[Check, ...]] = (
    service_install_of_detective_runs_beside_it,
    both_boards_are_in_service_status,
)
