"""A control group with a quota of processor time, of version 1 or 2, while it is needed.

Its share is the greatest there is: its processes use up the quota however busy the machine is.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PERIOD_US = 100_000
QUOTA_US = 20_000


class NoQuotaError(Exception):
    """No group can be made here; says why."""


@contextmanager
def limited(pid: int) -> Iterator[None]:
    """Within the block, a process is in a group of its own; it must have ended by then.

    Raises NoQuotaError.
    """
    folder = _parent() / _name(pid)
    try:
        folder.mkdir()
    except OSError as error:
        raise NoQuotaError(f"{folder} cannot be made ({error.strerror})") from error
    try:
        _limit(folder)
        put(pid, folder)
        yield
    finally:
        folder.rmdir()


def put(pid: int, folder: Path) -> None:
    """Move a process into the group."""
    (folder / "cgroup.procs").write_text(str(pid))


def put_beside(pid: int, other: int) -> None:
    """Move a process into the group of another that was put into one."""
    put(pid, _parent() / _name(other))


def _name(pid: int) -> str:
    return f"firmware-runtime-bench-{pid}"


def _limit(folder: Path) -> None:
    try:
        if (folder / "cpu.max").exists():
            (folder / "cpu.max").write_text(f"{QUOTA_US} {PERIOD_US}")
            (folder / "cpu.weight").write_text("10000")
        else:
            (folder / "cpu.cfs_period_us").write_text(str(PERIOD_US))
            (folder / "cpu.cfs_quota_us").write_text(str(QUOTA_US))
            (folder / "cpu.shares").write_text("262144")
    except OSError as error:
        raise NoQuotaError(f"{folder}: no quota can be set ({error.strerror})") from error


def _parent() -> Path:
    """Where groups with the controller `cpu` are made: of version 1, else at the root of 2."""
    for line in Path("/proc/self/mounts").read_text().splitlines():
        _, place, kind, options = line.split()[:4]
        if kind == "cgroup" and "cpu" in options.split(","):
            return Path(place)
        if kind == "cgroup2" and "cpu" in _controllers(Path(place)):
            return Path(place)
    raise NoQuotaError("no control groups with the controller cpu are mounted")


def _controllers(root: Path) -> list[str]:
    """Those that a group below this one would have."""
    path = root / "cgroup.subtree_control"
    return path.read_text().split() if os.access(path, os.R_OK) else []
