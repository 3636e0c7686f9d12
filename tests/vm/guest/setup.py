"""The program and the doubles come into the guest."""

import shutil
from pathlib import Path
from typing import Final

from tests.vm.guest.machine import CARRIED, PROGRAM, PYTHON, device_of, run
from tests.vm.guest.report import Check

CHECKS_HOME: Final = Path("/opt/vm")


def the_wheel_is_installed() -> str:
    """Into the venv that has what it needs."""
    wheel = next(CARRIED.glob("firmware_runtime-*.whl"))
    run(PYTHON, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps", wheel)
    return run(PROGRAM, "--version").strip()


def doubles_are_plugged_in_as_real_adapters() -> str:
    """One for each robot; the unit is there after a reboot too."""
    shutil.copytree(CARRIED / "tests", CHECKS_HOME / "tests")
    units = CHECKS_HOME / "tests/vm/guest/units"
    shutil.copytree(units, "/etc/systemd/system", dirs_exist_ok=True)
    run("systemctl", "daemon-reload")
    for board in ("tachobot", "detective"):
        run("systemctl", "enable", "--now", f"doubles@{board}")
    return f"{device_of('tachobot')} and {device_of('detective')}"


CHECKS: Final[tuple[Check, ...]] = (
    the_wheel_is_installed,
    doubles_are_plugged_in_as_real_adapters,
)
