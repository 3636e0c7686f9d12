"""A control group of the kernel that bounds the memory of a process, version 1 or 2."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

_ROOTS = (
    (Path("/sys/fs/cgroup/memory"), "memory.limit_in_bytes", "memory.memsw.limit_in_bytes"),
    (Path("/sys/fs/cgroup"), "memory.max", "memory.swap.max"),
)


@contextmanager
def memory_limit(limit: int) -> Iterator[Path]:
    """A group whose processes are killed by the kernel above `limit` bytes; gives its folder."""
    for root, name, swap in _ROOTS:
        group = root / f"firmware-runtime-test-{os.getpid()}"
        try:
            group.mkdir()
        except OSError:
            continue
        try:
            if (group / name).exists():
                (group / name).write_text(str(limit))
                if (group / swap).exists():
                    (group / swap).write_text(str(limit if "memsw" in swap else 0))
                yield group
                return
        finally:
            group.rmdir()
    pytest.skip(
        "needs permission to make a control group with a memory limit (root, cgroup memory)"
    )


def enter(group: Path, pid: int) -> None:
    """Move a process into the group."""
    (group / "cgroup.procs").write_text(str(pid))


def killed_by_memory(group: Path) -> int:
    """How many processes of the group the kernel has killed for want of memory."""
    for name in ("memory.oom_control", "memory.events"):
        if (group / name).exists():
            counts = dict(line.split() for line in (group / name).read_text().splitlines())
            return int(counts["oom_kill"])
    raise AssertionError(f"{group} does not count its kills")
