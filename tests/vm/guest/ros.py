"""The unit of the ROS 2 node, with real rclpy: it arms, and its robot is off when it is killed."""

import os
import shutil
import signal
from pathlib import Path
from time import monotonic_ns
from typing import Final

from tests.vm.guest.machine import CARRIED, PATIENCE_S, PYTHON, expect, run, wait_until
from tests.vm.guest.report import Check
from tests.vm.guest.service import TACHOBOT

DISK: Final = Path("/dev/vdc")
"""Has what .venv-ros of the host has; not there where the host has none for this Python."""
ENVIRONMENT: Final = Path("/opt/firmware-runtime/ros")
UNIT: Final = "firmware-runtime-ros2@tachobot.service"
DROP_IN: Final = Path(f"/etc/systemd/system/{UNIT}.d/vm.conf")
LEASE_S: Final = 5.0
"""Emulated, the node renews its lease later than on a PC."""
UNHURRIED: Final = {"arming.max_late_percent": 100.0}
"""A node that starts beside it makes the run late."""
AS_BEFORE: Final = {"arming.max_late_percent": 1.0}
SKIPPED: Final = "skipped: the host has no .venv-ros for the guest's Python; expected `make ros`"


def the_ros_environment_is_laid_out() -> str:
    """A venv with rclpy from wheels, and this program."""
    if not DISK.exists():
        return SKIPPED
    run("python3", "-m", "venv", "--without-pip", ENVIRONMENT)
    run("tar", "--extract", f"--file={DISK}", f"--directory={ENVIRONMENT}")
    packages = next(ENVIRONMENT.glob("lib/python3*/site-packages"))
    run(PYTHON, "-m", "zipfile", "-e", next(CARRIED.glob("firmware_runtime-*.whl")), packages)
    return f"{shutil.disk_usage('/').free >> 20} MB are free"


def the_node_s_unit_is_active_and_arms_the_robot() -> str:
    """Its state is the lifecycle's: inactive until a request arms."""
    if not DISK.exists():
        return SKIPPED
    TACHOBOT.change(UNHURRIED)
    run("systemctl", "restart", TACHOBOT.runtime)
    TACHOBOT.wait_until_active()
    DROP_IN.parent.mkdir(exist_ok=True)
    options = f"--autostart --lease {LEASE_S:g}"
    DROP_IN.write_text(
        f'[Service]\nEnvironment="OPTIONS={options}"\nTimeoutStartSec=300\n', encoding="ascii"
    )
    run("systemctl", "daemon-reload")
    run("systemctl", "start", UNIT, timeout_s=300.0)
    _wait_until_it_is("inactive")
    _arm()
    _wait_until_it_is("active")
    return TACHOBOT.shown("StatusText", UNIT)


def a_killed_node_leaves_no_output_on_and_its_unit_comes_back() -> str:
    """SIGKILL: the lease runs out; the next node arms nothing."""
    if not DISK.exists():
        return SKIPPED
    pid, at = TACHOBOT.pid(UNIT), monotonic_ns()
    expect(pid > 0, "no node runs")
    os.kill(pid, signal.SIGKILL)
    took_ms = TACHOBOT.off_after_ms(at)
    expect(took_ms >= 0, "it was off before")
    wait_until(lambda: TACHOBOT.pid(UNIT) not in {0, pid}, "another node runs")
    _wait_until_it_is("inactive")
    expect(not TACHOBOT.is_armed(), "the next node has armed the robot")
    restarts = TACHOBOT.shown("NRestarts", UNIT)
    run("systemctl", "stop", UNIT)
    TACHOBOT.change(AS_BEFORE)
    run("systemctl", "restart", TACHOBOT.runtime)
    TACHOBOT.wait_until_active()
    shutil.rmtree(DROP_IN.parent)
    shutil.rmtree(ENVIRONMENT)
    run("systemctl", "daemon-reload")
    return f"off after {took_ms:.0f} ms, of which {LEASE_S * 1000:g} the lease; restart {restarts}"


def _wait_until_it_is(phase: str) -> None:
    wait_until(lambda: TACHOBOT.shown("StatusText", UNIT) == phase, f"the node is {phase}")


def _arm() -> None:
    """Call the node's service `arm` until the run is armed, as the node's own user."""
    words = (
        *("runuser", "-u", "firmware-runtime", "--", "env", "ROS_LOG_DIR=/tmp"),
        *("ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST", PYTHON),
        *("-m", "firmware_runtime.links.ros2.interpreter", str(ENVIRONMENT)),
    )
    client = Path(__file__).with_name("arm_by_ros.py")
    run(*words, client, timeout_s=2 * PATIENCE_S)
    wait_until(TACHOBOT.is_armed, "the run is armed")
    wait_until(lambda: not TACHOBOT.is_off(), "an output is on")


CHECKS: Final[tuple[Check, ...]] = (
    the_ros_environment_is_laid_out,
    the_node_s_unit_is_active_and_arms_the_robot,
    a_killed_node_leaves_no_output_on_and_its_unit_comes_back,
)
