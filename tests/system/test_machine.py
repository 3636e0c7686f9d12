"""A machine: its conditions, disks, adapters and groups."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.system import device_nodes
from firmware_runtime.system.conditions import system_conditions
from firmware_runtime.system.kernel_files import SystemFiles
from firmware_runtime.system.machine_counters import FrozenGroups, disks_ns
from tests.support.fake_machines import lay_out, link, pc, raspberry_pi
from tests.support.kernel_text import DISKS, disk_worked
from tests.support.waiting import wait_until

SHOWN = (
    "clock_source",
    "rt_runtime_us",
    "rt_period_us",
    "model",
    "virtualised",
    "cpus_isolated",
    "cpus_tickless",
    "governor",
    "memory_lock_limit_bytes",
)


def shown(files: SystemFiles) -> dict[str, object]:
    conditions = system_conditions(files)
    return {name: conditions[name] for name in SHOWN}


def test_conditions_of_a_raspberry_pi(tmp_path: Path) -> None:
    assert shown(raspberry_pi(tmp_path).files) == {
        "clock_source": "arch_sys_counter",
        "rt_runtime_us": 950000,
        "rt_period_us": 1000000,
        "model": "Raspberry Pi 4 Model B Rev 1.4",
        "virtualised": False,
        "cpus_isolated": [],
        "cpus_tickless": [],
        "governor": "ondemand",
        "memory_lock_limit_bytes": 8388608,
    }


def test_conditions_of_a_pc_with_isolated_processors(tmp_path: Path) -> None:
    conditions = shown(pc(tmp_path).files)
    assert (conditions["cpus_isolated"], conditions["cpus_tickless"]) == ([2, 3], [3])
    assert (conditions["model"], conditions["virtualised"]) == (None, False)


def test_where_nothing_shows_conditions_are_null(tmp_path: Path) -> None:
    assert shown(SystemFiles(tmp_path)) == dict.fromkeys(SHOWN)


def test_conditions_of_this_machine_can_be_written_as_json() -> None:
    conditions = system_conditions()
    assert json.loads(json.dumps(conditions)) == conditions
    assert set(SHOWN) < set(conditions)
    assert "preemption" in conditions


OLD = b"   8       0 sda 1 2 3 {read} 5 6 7 {write} 9 10 11\n"
"""Before Linux 4.18 there are eleven fields after the name."""


def content(**worked: int) -> bytes:
    return disk_worked(**worked)[DISKS].encode()


def test_reads_writes_and_flushes_of_the_busiest_add_up() -> None:
    worked = content(read_ms=3, write_ms=4, flush_ms=5)
    assert disks_ns(content(), worked) == 12 * MILLISECOND
    assert disks_ns(worked, worked) == 0


def test_an_old_kernel_counts_no_flushes() -> None:
    before = OLD.replace(b"{read}", b"4").replace(b"{write}", b"8")
    after = OLD.replace(b"{read}", b"5").replace(b"{write}", b"10")
    assert disks_ns(before, after) == 3 * MILLISECOND


def test_a_disk_that_has_just_come_has_done_nothing_yet() -> None:
    assert disks_ns(OLD.replace(b"{read}", b"4").replace(b"{write}", b"8"), content()) == 0


def test_without_a_disk_or_its_account_nothing_is_measured() -> None:
    assert disks_ns(None, None) is None
    assert disks_ns(b"", b"   7       0 loop0 0 0 0 0 0 0 0 0 0 0 0\n") is None


@pytest.mark.parametrize(
    ("name", "is_left_alone"),
    [
        ("bcm2835 (i2c@7e804000)", False),
        ("Synopsys DesignWare I2C adapter", False),
        ("i2c-tiny-usb at bus 001 device 002", False),
        ("i2c-gpio3", False),
        ("SMBus I801 adapter at efa0", True),
        ("SMBus PIIX4 adapter port 0 at 0b00", True),
        ("i915 gmbus dpb", True),
        ("AMDGPU DM i2c hw bus 0", True),
        ("NVIDIA i2c adapter 3 at 1:00.0", True),
        ("DPDDC-A", True),
        ("AUX A/DDI A/PHY A", True),
        ("fef04500.i2c", True),
        ("107d508280.i2c", True),
    ],
)
def test_buses_of_displays_and_mainboard_are_recognised_by_their_names(
    tmp_path: Path, name: str, *, is_left_alone: bool
) -> None:
    files = lay_out(tmp_path, {"/dev/i2c-3": "", "/sys/bus/i2c/devices/i2c-3/name": f"{name}\n"})
    assert device_nodes.adapter_name(files, "/dev/i2c-3") == name
    assert (device_nodes.not_for_robots(files, "/dev/i2c-3") is not None) is is_left_alone


def test_a_bus_that_hangs_below_a_graphics_card_is_a_displays(tmp_path: Path) -> None:
    card = "/sys/devices/pci0000:00/0000:00:02.0/drm/card0/card0-DP-1/i2c-5"
    files = lay_out(tmp_path, {"/dev/i2c-5": "", f"{card}/name": "of an unknown kind\n"})
    link(tmp_path, "/sys/bus/i2c/devices/i2c-5", tmp_path / card.lstrip("/"))
    assert "display" in (device_nodes.not_for_robots(files, "/dev/i2c-5") or "")


def test_a_bus_that_is_linked_to_a_connector_is_a_displays(tmp_path: Path) -> None:
    files = lay_out(tmp_path, {"/dev/i2c-5": "", "/sys/bus/i2c/devices/i2c-5/name": "soc:i2c\n"})
    assert device_nodes.not_for_robots(files, "/dev/i2c-5") is None
    adapter = tmp_path / "sys/bus/i2c/devices/i2c-5"
    link(tmp_path, "/sys/class/drm/card0-HDMI-A-1/ddc", adapter)
    assert "display" in (device_nodes.not_for_robots(files, "/dev/i2c-5") or "")


def test_a_held_address_comes_with_its_driver(tmp_path: Path) -> None:
    files = lay_out(tmp_path, {"/dev/i2c-1": "", "/sys/bus/i2c/drivers/inv-mpu6050-i2c/uevent": ""})
    driver = tmp_path / "sys/bus/i2c/drivers/inv-mpu6050-i2c"
    link(tmp_path, "/sys/bus/i2c/devices/1-0068/driver", driver)
    assert device_nodes.bound_addresses(files, "/dev/i2c-1") == [
        ("/dev/i2c-1", 0x68, "inv-mpu6050-i2c")
    ]


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
