"""A bare computer becomes a robot, restarts, gets another version, and refuses a bad one."""

import re
import shutil
from functools import cache
from pathlib import Path
from time import monotonic
from typing import Final

from tests.pi.full.stand import Robot, Stand
from tests.vm.guest.machine import expect
from tests.vm.wheels import PROJECT, make_wheel

UNIT: Final = "systemd/firmware-runtime@.service"
STEP: Final = "drivers/firmware_drivers/imu.py"
READING: Final = "        phase = self.phase\n"
"""Where each period begins."""
SECOND: Final = "0.1.1"
MARK: Final = "of the second version"
"""What unit and settings of the second version say."""


def altered(stand: Stand, version: str, file: str, old: str, new: str) -> Path:
    """Return a wheel of another version of the program, with one thing changed in it."""
    project, wheels = stand.folder / f"altered-{version}", stand.wheels / version
    shutil.rmtree(project, ignore_errors=True)
    shutil.rmtree(wheels, ignore_errors=True)
    shutil.copytree(PROJECT, project, symlinks=True, ignore=_NOT_OF_THE_PROGRAM)
    for path, before, after in (
        ("pyproject.toml", 'version = "0.1.0"', f'version = "{version}"'),
        (file, old, new),
    ):
        text = (project / path).read_text(encoding="utf-8")
        expect(before in text, f"{path}: no {before!r} to change")
        (project / path).write_text(text.replace(before, after, 1), encoding="utf-8")
    wheels.mkdir()
    return make_wheel(wheels, project)


_NOT_OF_THE_PROGRAM: Final = shutil.ignore_patterns(
    ".*", "build", "tests", "docs", "*.egg-info", "__pycache__"
)


@cache
def second_version(stand: Stand) -> Path:
    """Return a wheel of a version that differs in its unit."""
    return altered(stand, SECOND, UNIT, "[Unit]", f"# {MARK}\n[Unit]")


def a_bare_computer_becomes_a_robot(stand: Stand) -> str:
    """By one `deploy`, over ssh, as a user with sudo."""
    with stand.on("deployed", "bare") as robot:
        done = robot.deploy(
            *("--settings", stand.settings("of the first version")),
            *("--wheel", next(stand.wheels.glob("firmware_runtime-*.whl"))),
        )
        expect(done.returncode == 0, f"{done.stdout[-3000:]}{done.stderr}")
        outputs = robot.expect_it_is_at_rest()
        robot.switch_off()
    return f"{_steps(done.stdout)}; outputs {outputs}"


def _steps(printed: str) -> str:
    """Return the steps of a deployment, and how long each took."""
    steps = re.findall(r"^(\S.*)\n(?:(?:  .*)?\n)*?  ([0-9.]+ s)$", printed, re.MULTILINE)
    return "; ".join(" ".join(step) for step in steps)


def it_comes_back_when_it_is_switched_on_again(stand: Stand) -> str:
    """Run and guard, disarmed."""
    with stand.on("restarted", "deployed") as robot:
        return f"outputs {robot.expect_it_is_at_rest()}"


def an_update_that_proves_itself_is_committed(stand: Stand) -> str:
    """With its own unit; the version before is kept."""
    with stand.on("updated", "deployed") as robot:
        done = robot.deploy("--wheel", second_version(stand))
        expect(done.returncode == 0, f"{done.stdout[-3000:]}{done.stderr}")
        status = robot.status()
        expect("committed" in status, status)
        expect(robot.version().version == SECOND, status)
        unit = robot.computer.run("cat /etc/systemd/system/firmware-runtime@.service")
        expect(MARK in unit, "the unit is not that of the second version")
        outputs = robot.expect_it_is_at_rest()
    return f"{' | '.join(status.splitlines())}; {_steps(done.stdout)}; outputs {outputs}"


def a_build_that_is_slow_is_taken_back(stand: Stand) -> str:
    """One that sleeps in each step for as long as a step took before."""
    with stand.on("slow", "deployed") as robot:
        usual_us = float(robot.wait_until_it_runs()["step_us"]["p50"])
        sleeps = f"import time; time.sleep({usual_us / 1e6:.4f})"
        wheel = altered(stand, "0.1.2", STEP, READING, f"        {sleeps}\n{READING}")
        return f"a sleep of {usual_us / 1000:.1f} ms; {_taken_back(robot, wheel, 'a step takes')}"


def a_build_that_does_not_start_is_taken_back(stand: Stand) -> str:
    """One whose service ends at once."""
    with stand.on("broken", "deployed") as robot:
        robot.wait_until_it_runs()
        start = "ExecStart=/opt/firmware-runtime/venv/bin/firmware-runtime run"
        wheel = altered(stand, "0.1.3", UNIT, start, "ExecStart=/bin/false")
        return _taken_back(robot, wheel, "")


def _taken_back(robot: Robot, wheel: Path, reason: str) -> str:
    began_at = monotonic()
    done = robot.deploy("--wheel", wheel)
    took_s = monotonic() - began_at
    status = robot.status()
    expect(done.returncode != 0, f"deploy took it: {status}")
    expect("reverted" in status, f"{status}{done.stdout[-2000:]}")
    expect(robot.version().version == "0.1.0", status)
    expect(reason in status, status)
    outputs = robot.expect_it_is_at_rest()
    return (
        f"{' | '.join(status.splitlines())}; in all {took_s:.0f} s: {_steps(done.stdout)}; "
        f"outputs {outputs}"
    )
