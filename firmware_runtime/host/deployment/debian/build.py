"""Builds the Debian package of a checkout."""

import re
from pathlib import Path
from tempfile import TemporaryDirectory

from firmware_runtime.host.deployment import project_wheel, wheels
from firmware_runtime.host.deployment.commands import Commands
from firmware_runtime.host.deployment.debian import tree
from firmware_runtime.host.deployment.errors import DeploymentError
from firmware_runtime.host.deployment.platform import LEAST_PYTHON, MACHINES, Platform

DEBIANS_PYTHON = "/usr/bin/python3"


def platform_for(commands: Commands, architecture: str | None, python: str | None) -> Platform:
    """The requested platform; this computer's, and its Debian's Python, where none is.

    Raises DeploymentError for one that the project does not run on.
    """
    architecture = architecture or _answer(commands, "dpkg", "--print-architecture")
    python = python or _answer(
        commands, DEBIANS_PYTHON, "-c", "import sys; print('%d.%d' % sys.version_info[:2])"
    )
    machines = {each: machine for machine, each in MACHINES.items()}
    if architecture not in machines:
        raise DeploymentError(f"ARCH={architecture}: expected one of {', '.join(machines)}")
    if (release := _release(python)) < LEAST_PYTHON:
        least = ".".join(map(str, LEAST_PYTHON))
        raise DeploymentError(f"PYTHON_VERSION={python}: expected {least} or later, such as 3.13")
    return Platform(machines[architecture], release)


def build(commands: Commands, platform: Platform, into: Path, own: Path | None = None) -> Path:
    """Build the package into a folder and return it.

    `own` is the project's wheel, built from the checkout when None. Raises DeploymentError.
    """
    source = project_wheel.checkout()
    if source is None:
        raise DeploymentError("no pyproject.toml; expected to run from a checkout")
    into.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as temporary:
        folder = Path(temporary, "tree")
        wheelhouse = folder / tree.WHEELS
        commands.log(wheels.collect(commands, platform, own, wheelhouse))
        wheel = next(wheelhouse.glob(f"{project_wheel.NAME}-*.whl"))
        version = wheel.name.split("-")[1]
        tree.fill(folder, platform, version, source)
        package = into / f"{tree.NAME}_{version}_{MACHINES[platform.machine]}.deb"
        # gzip, because every dpkg reads it and wheels do not get smaller by more.
        words = ["dpkg-deb", "--root-owner-group", "-Zgzip", "--build", str(folder), str(package)]
        commands.demand(words, f"{package}: not built")
    return package


def _release(python: str) -> tuple[int, int]:
    """The two numbers of such as `3.13`; zeros where it is no such thing."""
    numbers = re.fullmatch(r"(\d+)\.(\d+)", python)
    return (int(numbers[1]), int(numbers[2])) if numbers else (0, 0)


def _answer(commands: Commands, *words: str) -> str:
    ended = commands.run(words)
    if ended.status != 0:
        raise DeploymentError(f"{words[0]}: {ended.reason}")
    return ended.out.strip()
