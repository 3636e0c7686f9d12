"""Wheels for the guest's Python, which need not be this one; the guest has no network."""

import shutil
import sys
import tarfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from tests.vm.commands import run

HERE: Final = Path(__file__).parent
PROJECT: Final = HERE.parents[1]
PLATFORMS: Final = ("manylinux_2_28_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64")
SOURCE_ONLY: Final = ("sdnotify",)
"""Dependencies published as source only; pure Python, so a wheel made here fits there."""


def fetch_wheels(requirements: Sequence[str], folder: Path, python: str) -> None:
    """Fetch wheels of everything that is required, for this version of Python."""
    folder.mkdir()
    source_only = [each for each in requirements if each.startswith(SOURCE_ONLY)]
    pip("wheel", "--no-deps", "--wheel-dir", folder, *source_only)
    platforms = [f"--platform={platform}" for platform in PLATFORMS]
    target = [f"--python-version={python}", "--implementation=cp", "--only-binary=:all:"]
    pip("download", *target, *platforms, "--find-links", folder, "--dest", folder, *requirements)


def make_wheel(folder: Path, project: Path = PROJECT) -> Path:
    """Make the wheel of a copy of the project in a folder, in place of one that is there."""
    for wheel in folder.glob("firmware_runtime-*.whl"):
        wheel.unlink()
    shutil.rmtree(project / "build/lib", ignore_errors=True)  # else removed modules come along
    pip("wheel", "--no-deps", "--wheel-dir", folder, project)
    return next(folder.glob("firmware_runtime-*.whl"))


def write_carried(disk: Path, work: Path, only: Sequence[str]) -> None:
    """Write the project's wheel and the checks as a tar archive, which is a disk for the guest.

    `only` are the modules of checks to carry out; all, where none are named.
    """
    wheel = make_wheel(work)
    (work / "only").write_text("\n".join(only), encoding="utf-8")
    with tarfile.open(disk, "w") as archive:
        archive.add(work / "only", "only")
        archive.add(wheel, wheel.name)
        archive.add(HERE / "guest", "tests/vm/guest", filter=_is_source)


def write_ros(disk: Path, python: str) -> None:
    """Write what .venv-ros has as a tar archive, a second disk for the guest.

    There is none where the host has no such environment for this version of Python.
    """
    disk.unlink(missing_ok=True)
    environment = PROJECT / ".venv-ros"
    if not (environment / f"lib/python{python}/site-packages/rclpy").exists():
        return
    with tarfile.open(disk, "w") as archive:
        for name in ("lib", "share"):
            if (environment / name).exists():
                archive.add(environment / name, name, filter=_is_of_ros)


def _is_of_ros(member: tarfile.TarInfo) -> tarfile.TarInfo | None:
    """All but this program, which the guest lays there itself, and pip."""
    name = member.name.partition("site-packages/")[2]
    return None if name.startswith(("__editable__", "firmware_runtime", "pip")) else member


def _is_source(member: tarfile.TarInfo) -> tarfile.TarInfo | None:
    return None if "__pycache__" in member.name else member


def pip(*words: object) -> None:
    """Run this Python's pip. Raises Unbuildable."""
    run(sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *words)
