"""A process that is halted by the freezer of control groups knows it afterwards."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from firmware_runtime.system.machine_counters import FrozenGroups
from tests.support.fake_machines import lay_out
from tests.support.waiting import wait_until

COUNTS = """
from firmware_runtime.system.kernel_files import THIS_MACHINE
from firmware_runtime.system.machine_counters import FrozenGroups
frozen = FrozenGroups(THIS_MACHINE)
while True:
    print(frozen.times, flush=True)
    input()
"""


@pytest.fixture
def group(tmp_path: Path) -> Iterator[Path]:
    """A control group of version 2, in a mount of its own if this system has none."""
    root = Path("/sys/fs/cgroup")
    is_mounted = (root / "cgroup.controllers").exists()
    if not is_mounted:
        root = tmp_path
        command = ["mount", "-t", "cgroup2", "none", str(root)]
        if subprocess.run(command, capture_output=True, check=False).returncode != 0:
            pytest.skip("needs permission to mount control groups of version 2 (root)")
    made = root / f"firmware-runtime-frozen-{os.getpid()}"
    try:
        made.mkdir()
    except OSError:
        pytest.skip("needs permission to make a control group (root)")
    yield made
    made.rmdir()
    if not is_mounted:
        subprocess.run(["umount", str(root)], check=True)


@pytest.mark.slow
def test_a_group_that_froze_and_went_on_is_counted(group: Path) -> None:
    def says() -> str:
        assert counts.stdout is not None
        return counts.stdout.readline().strip()

    command = ["sh", "-c", f'echo $$ > {group}/cgroup.procs && exec "$@"', "sh"]
    command += [sys.executable, "-c", COUNTS]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1
    ) as counts:
        assert counts.stdin is not None
        assert says() == "0"
        counts.stdin.write("\n")
        assert says() == "0"
        for state in (1, 0):
            (group / "cgroup.freeze").write_text(str(state))
            wait_until(lambda state=state: is_frozen(group) is bool(state), "it is so")  # type: ignore[misc]
        counts.stdin.write("\n")
        assert int(says()) > 0
        counts.kill()
        counts.stdin.close()
    wait_until(lambda: not (group / "cgroup.procs").read_text(), "it is gone")


def is_frozen(group: Path) -> bool:
    return "frozen 1" in (group / "cgroup.events").read_text()


def test_a_system_without_such_groups_knows_nothing(tmp_path: Path) -> None:
    files = lay_out(tmp_path, {"/proc/self/cgroup": "0::/\n", "/proc/self/mounts": ""})
    assert FrozenGroups(files).times is None


def test_a_file_that_never_changes_counts_nothing(tmp_path: Path) -> None:
    files = lay_out(
        tmp_path,
        {
            "/proc/self/cgroup": "9:name=systemd:/\n0::/system.slice/a.service\n",
            "/proc/self/mounts": "cgroup2 /sys/fs/cgroup cgroup2 rw 0 0\n",
            "/sys/fs/cgroup/system.slice/a.service/cgroup.events": "populated 1\nfrozen 0\n",
        },
    )
    frozen = FrozenGroups(files)
    assert (frozen.times, frozen.times) == (0, 0)
    frozen.close()
    assert frozen.times is None
