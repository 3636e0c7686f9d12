"""Surroundings of a run: service manager, watchdog, room for its files, other runs, the guard."""

import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

from firmware_runtime.errors import StatisticsFileError
from firmware_runtime.host.doctor.check import (
    Check,
    Finding,
    Machine,
    failure,
    not_applicable,
    note,
    ok,
    warning,
)
from firmware_runtime.statistics.paths import SYSTEM, find_statistics
from firmware_runtime.statistics.reader import read_statistics
from firmware_runtime.statistics.statistics import Statistics

_MIB = 1 << 20
_FEW_MIB, _SOME_MIB = 16, 256
_SOME_OF_MEMORY_MIB = 64
"""For statistics alone: /run of a computer with 1 GB has no more than 100."""
_NO_RUN = "no run of this board is under way"


def _systemd(machine: Machine) -> Finding:
    if machine.files.exists("/run/systemd/system"):
        return ok("runs this machine")
    return note("does not run this machine")


def _watchdog(machine: Machine) -> Finding:
    found = machine.files.matching("/sys/class/watchdog/watchdog[0-9]*")
    if not found:
        there = machine.files.matching("/dev/watchdog*")
        seen = f"{there[0]}; nothing more is shown" if there else "none"
        return ok(seen) if there else note(seen)
    identity = machine.files.text(f"{found[0]}/identity") or "name not shown"
    longest = machine.files.integer(f"{found[0]}/max_timeout")
    bound = "" if longest is None or longest == 0 else f", at most {longest} s"
    return ok(f"{found[0].rpartition('/')[2]}: {identity}{bound}")


def _statistics_directory(_machine: Machine) -> Finding:
    stated = (
        os.environ.get("FIRMWARE_RUNTIME_STATE_DIRECTORY")
        or os.environ.get("RUNTIME_DIRECTORY", "").partition(":")[0]
    )
    place = _nearest(Path(stated or SYSTEM))
    if os.access(place, os.W_OK | os.X_OK) and (stated or place == SYSTEM):
        return ok(f"{stated or SYSTEM} may be written")
    if stated:
        return failure(f"{stated} may not be written by this user")
    if os.access(tempfile.gettempdir(), os.W_OK | os.X_OK):
        return note(
            f"{SYSTEM} is absent or closed to this user; statistics go to a place of the user's own"
        )
    return failure(f"neither {SYSTEM} nor {tempfile.gettempdir()} may be written by this user")


def _nearest(path: Path) -> Path:
    """The path itself, or the nearest folder above it that this user can see."""
    for each in (path, *path.parents):
        with suppress(PermissionError):
            if each.is_dir():
                return each
    return Path("/")


def _disk_space(_machine: Machine) -> Finding:
    stated = os.environ.get("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(SYSTEM))
    places = dict.fromkeys(_nearest(Path(each)) for each in (stated, tempfile.gettempdir()))
    free = {place: shutil.disk_usage(place).free / _MIB for place in places}
    seen = ", ".join(f"{place} {left:.0f} MiB free" for place, left in free.items())
    if min(free.values()) < _FEW_MIB:
        return failure(seen)
    asked = {_nearest(Path(tempfile.gettempdir())): _SOME_MIB}
    scarce = any(left < asked.get(place, _SOME_OF_MEMORY_MIB) for place, left in free.items())
    return warning(seen) if scarce else ok(seen)


def _other_run(machine: Machine) -> Finding:
    try:
        run = _run(machine)
    except StatisticsFileError as error:
        return not_applicable(str(error))
    if run is None or not run.writer_alive:
        return ok(_NO_RUN if machine.demands else "no run is under way")
    process = run.header.writer.pid
    seen = f"process {process} runs {run.header.board or 'a board'}"
    return note(seen, f"kill {process}, or sudo systemctl stop its unit")


def _guard(machine: Machine) -> Finding:
    try:
        run = _run(machine)
    except StatisticsFileError as error:
        return not_applicable(str(error))
    if run is None or not run.writer_alive:
        return not_applicable("no run is under way")
    if run.is_guarded:
        return ok("a guard watches over the run")
    return warning("a run is under way and no guard watches over it", _start_guard(run))


def _start_guard(run: Statistics) -> str:
    return f"firmware-runtime guard {run.header.board or 'BOARD'}"


def _run(machine: Machine) -> Statistics | None:
    """The board's last run, or the last of any; None if there has been none."""
    try:
        path = find_statistics(machine.demands.board if machine.demands else None)
    except StatisticsFileError:
        return None
    return read_statistics(path)


CHECKS = (
    Check(
        "systemd",
        "A service is started with its limits and groups, started again when it dies, and its "
        "outputs are switched off after it.",
        "use a system with systemd, such as Raspberry Pi OS; elsewhere run firmware-runtime guard "
        "beside the run",
        _systemd,
    ),
    Check(
        "watchdog-device",
        "A watchdog restarts the computer when the kernel itself hangs; the one of a Raspberry Pi "
        "counts to 15 s at most.",
        "dtparam=watchdog=on in /boot/firmware/config.txt, RuntimeWatchdogSec=10 in "
        "/etc/systemd/system.conf, restart",
        _watchdog,
    ),
    Check(
        "statistics-directory",
        "A run writes what became of every activation into a file that other processes read; "
        "those of another user look in /run/firmware-runtime.",
        "sudo install -d -o $USER -m 0750 /run/firmware-runtime; RuntimeDirectory=firmware-runtime "
        "in the unit",
        _statistics_directory,
    ),
    Check(
        "disk-space",
        "The space of a statistics file is allocated when the run starts; without it there is no "
        "run, and no trace of the one before.",
        "find what takes the room: sudo du -xh / | sort -h | tail",
        _disk_space,
    ),
    Check(
        "other-run",
        "A second run of a board is refused its bus while the first one drives it.",
        "kill PID, or sudo systemctl stop its unit",
        _other_run,
    ),
    Check(
        "guard",
        "The chips keep their last command when the run dies: the guard switches them off.",
        "firmware-runtime guard BOARD",
        _guard,
    ),
)
