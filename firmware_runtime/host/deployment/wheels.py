"""Every wheel that a target needs: the project's own, those of its robots, and dependencies.

Dependencies are downloaded as wheels for the target. Those that are published as source alone are
built here; that needs no compiler, or the wheel would not fit the target and is refused. They are
kept in the user's cache, one folder a platform, until what the project asks for changes.
"""

import json
import os
import shutil
from collections.abc import Iterable, Sequence
from hashlib import sha256
from importlib.metadata import Distribution
from pathlib import Path
from typing import NamedTuple

from firmware_runtime.errors import DeploymentError
from firmware_runtime.host.deployment.connection import Commands
from firmware_runtime.host.deployment.package_wheel import (
    PIP,
    build_own,
    demand_ours,
    requirements,
    wheel_of,
)
from firmware_runtime.host.deployment.target import Platform

EXTRAS = ("gpio", "metrics", "top", "completion")
"""What a robot can use beside the bare program."""
SOURCE_ONLY = ("sdnotify",)
"""Dependencies that are published without a wheel."""
LOCK = "lock.json"


def cache_directory() -> Path:
    """Return where downloaded wheels are kept: `firmware-runtime/wheels` in the user's cache."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base, "firmware-runtime", "wheels")


class Collected(NamedTuple):
    """What was put into a folder of wheels."""

    ours: list[Path]
    """The project's, and those of the packages that go along."""
    text: str
    """What was done, in words."""


def collect(
    commands: Commands,
    platform: Platform,
    own: Path | None,
    into: Path,
    packages: Sequence[Distribution] = (),
) -> Collected:
    """Put every wheel that the platform needs into a folder.

    `own` is the project's wheel, made here when None; `packages` provide boards of other projects.
    Raises DeploymentError when one cannot be had or does not fit.
    """
    into.mkdir(parents=True, exist_ok=True)
    wheel = build_own(commands, into) if own is None else Path(shutil.copy2(own, into))
    ours = [wheel, *(wheel_of(package, commands, into) for package in packages)]
    if commands.dry_run:
        _download(commands, platform, ours, into)
        return Collected(ours, "")
    demand_ours(wheel)
    source = _add_others(commands, platform, ours, into)
    files = list(into.iterdir())
    size = sum(file.stat().st_size for file in files)
    made = " and ".join(each.name for each in ours)
    others = len(files) - len(ours)
    return Collected(ours, f"{made} and {others} others {source}, {size / 1e6:.1f} MB")


def _add_others(commands: Commands, platform: Platform, ours: Sequence[Path], into: Path) -> str:
    """Add what our wheels depend on, from the cache if it has all; return where it came from."""
    wanted = [*EXTRAS, *(each for made in ours for each in requirements(made))]
    cache = cache_directory() / str(platform)
    if _is_kept(cache, wanted):
        for file in cache.glob("*.whl"):
            shutil.copy2(file, into)
        _demand_fitting(platform, into)
        return "from the cache"
    _download(commands, platform, ours, into)
    _demand_fitting(platform, into)
    _keep(cache, wanted, [file for file in sorted(into.iterdir()) if file not in ours])
    return "downloaded"


def _download(commands: Commands, platform: Platform, ours: Sequence[Path], into: Path) -> None:
    build = [*PIP, "wheel", "--no-deps", "--wheel-dir", str(into), *SOURCE_ONLY]
    commands.demand(build, f"{', '.join(SOURCE_ONLY)}: no wheel")
    wheel, *others = map(str, ours)
    download = [*PIP, "download", *platform.pip_options, "--find-links", str(into)]
    download += ["--dest", str(into), f"{wheel}[{','.join(EXTRAS)}]", *others]
    commands.demand(download, f"no wheels for {platform}")


def _demand_fitting(platform: Platform, folder: Path) -> None:
    for file in sorted(folder.iterdir()):
        if not platform.takes(file.name):
            raise DeploymentError(
                "does not fit", where=file.name, expected=f"a wheel for {platform}"
            )


def _is_kept(cache: Path, wanted: Sequence[str]) -> bool:
    """Return whether the cache has what is wanted, and every file of it as it was."""
    try:
        lock = json.loads((cache / LOCK).read_text())
        return bool(lock["wanted"] == wanted and lock["files"] == _sums(cache.glob("*.whl")))
    except (OSError, ValueError, KeyError):
        return False


def _keep(cache: Path, wanted: Sequence[str], files: Sequence[Path]) -> None:
    shutil.rmtree(cache, ignore_errors=True)
    cache.mkdir(parents=True)
    for file in files:
        shutil.copy2(file, cache)
    lock = {"wanted": list(wanted), "files": _sums(files)}
    (cache / LOCK).write_text(json.dumps(lock, indent=2) + "\n")


def _sums(files: Iterable[Path]) -> dict[str, str]:
    return {file.name: sha256(file.read_bytes()).hexdigest() for file in sorted(files)}
