"""A bare computer becomes a robot, restarts, and refuses bad versions."""

import re
import shutil
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Final

from tests.pi.full.stand import Robot, Stand
from tests.vm.guest.machine import expect
from tests.vm.guest.report import Check
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


def second_version(stand: Stand) -> Path:
    """Return a wheel of a version that differs in its unit."""
    return altered(stand, SECOND, UNIT, "[Unit]", f"# {MARK}\n[Unit]")


def a_bare_computer_becomes_a_robot(stand: Stand) -> str:
    """By one `deploy`, over ssh, as a user with sudo."""
    card = stand.copied("bare", "deployed")
    with stand.on("deployed", card, is_kept=True) as robot:
        done = robot.deploy(
            *("--settings", stand.settings("of the first version")),
            *("--wheel", next(stand.wheels.glob("firmware_runtime-*.whl"))),
        )
        expect(done.returncode == 0, f"{done.stdout[-3000:]}{done.stderr}")
        outputs = robot.expect_it_is_at_rest()
        robot.switch_off()
    return f"{steps_in(done.stdout)}; outputs {outputs}"


def steps_in(printed: str) -> str:
    """Return the steps of a deployment, and how long each took."""
    steps = re.findall(r"^(\S.*)\n(?:(?:  .*)?\n)*?  ([0-9.]+ s)$", printed, re.MULTILINE)
    return "; ".join(" ".join(step) for step in steps)


def switched_on_again(stand: Stand) -> Iterator[tuple[str, Check]]:
    """Yield what is done with a computer that was deployed to, from its start on."""
    with stand.on("restarted", stand.card("deployed")) as robot:
        for check in (
            it_comes_back_when_it_is_switched_on_again,
            a_build_that_does_not_start_is_taken_back,
            a_build_that_is_slow_is_taken_back,
        ):
            yield check.__name__.replace("_", " "), partial(check, stand, robot)


def it_comes_back_when_it_is_switched_on_again(_: Stand, robot: Robot) -> str:
    """Run and guard, disarmed."""
    outputs = robot.expect_it_is_at_rest()
    return f"{robot.computer.age_s:.0f} s after it was switched on; outputs {outputs}"


def a_build_that_is_slow_is_taken_back(stand: Stand, robot: Robot) -> str:
    """One that sleeps in each step for as long as a step took before."""
    usual_us = float(robot.wait_until_it_runs()["step_us"]["p50"])
    sleeps = f"import time; time.sleep({usual_us / 1e6:.4f})"
    wheel = altered(stand, "0.1.2", STEP, READING, f"        {sleeps}\n{READING}")
    return f"a sleep of {usual_us / 1000:.1f} ms; {_taken_back(robot, wheel, 'a step takes')}"


def a_build_that_does_not_start_is_taken_back(stand: Stand, robot: Robot) -> str:
    """One whose service ends at once."""
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
        f"{' | '.join(status.splitlines())}; in all {took_s:.0f} s: {steps_in(done.stdout)}; "
        f"outputs {outputs}"
    )
