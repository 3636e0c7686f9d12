"""What the readers of /proc and /sys make of several machines."""

from pathlib import Path

import pytest

from firmware_runtime.system.device_nodes import Holder, holders
from firmware_runtime.system.kernel_files import (
    SystemFiles,
    cpu_group_file,
    cpu_list,
    governors,
    has_capability,
    limit,
    online,
    preemption,
    virtualised,
)
from tests.support.fake_machines import lay_out, link, raspberry_pi

DYNAMIC = "#1 SMP PREEMPT_DYNAMIC Debian 6.1.119-1 (2024-11-22)"


@pytest.mark.parametrize(
    ("text", "cpus"),
    [
        ("0-2,5", [0, 1, 2, 5]),
        ("3", [3]),
        ("", []),
        ("(null)", []),
        (None, None),
        ("odd", None),
        ("1-x", None),
    ],
)
def test_a_list_of_processors(text: str | None, cpus: list[int] | None) -> None:
    assert cpu_list(text) == cpus


@pytest.mark.parametrize(
    ("build", "model"),
    [
        ("#1 SMP PREEMPT_RT Debian 6.1.119-1", "rt"),
        ("#1 SMP PREEMPT Debian 1:6.6.51-1+rpt3", "full"),
        ("#22-Ubuntu SMP Tue May 16", "none or voluntary"),
        (DYNAMIC, "dynamic"),
        ("Darwin Kernel", None),
        ("", None),
    ],
)
def test_the_version_shows_the_preemption_model(
    tmp_path: Path, build: str, model: str | None
) -> None:
    assert preemption(SystemFiles(tmp_path), build) == model


@pytest.mark.parametrize(
    ("path", "text", "model"),
    [
        ("/sys/kernel/debug/sched/preempt", "none voluntary (full)\n", "full"),
        ("/sys/kernel/debug/sched/preempt", "none voluntary full (lazy)\n", "lazy"),
        ("/proc/cmdline", "quiet preempt=none rw", "none"),
        ("/proc/cmdline", "quiet nopreempt=none rw", "dynamic"),
        ("/sys/kernel/realtime", "1\n", "rt"),
    ],
)
def test_what_was_chosen_at_boot_is_found(tmp_path: Path, path: str, text: str, model: str) -> None:
    assert preemption(lay_out(tmp_path, {path: text}), DYNAMIC) == model


@pytest.mark.parametrize(
    ("path", "text", "answer"),
    [
        ("/proc/cpuinfo", "flags\t\t: fpu tsc hypervisor\n", True),
        ("/proc/cpuinfo", "flags\t\t: fpu tsc\n", False),
        ("/proc/cpuinfo", "Features\t: fp asimd\n", None),
        ("/sys/hypervisor/type", "xen\n", True),
        ("/proc/device-tree/hypervisor/compatible", "xen,xen\0", True),
        ("/proc/device-tree/compatible", "linux,dummy-virt\0", True),
        ("/proc/device-tree/compatible", "raspberrypi,4-model-b\0brcm,bcm2711\0", False),
        ("/sys/class/dmi/id/sys_vendor", "QEMU\n", True),
        ("/sys/class/dmi/id/product_name", "Virtual Machine\n", True),
        ("/sys/class/dmi/id/sys_vendor", "LENOVO\n", None),
        ("/anything/else", "", None),
    ],
)
def test_a_virtual_machine_is_known_by_its_marks(
    *, tmp_path: Path, path: str, text: str, answer: bool | None
) -> None:
    assert virtualised(lay_out(tmp_path, {path: text})) is answer


def test_limits_are_numbers_or_unlimited(tmp_path: Path) -> None:
    files = lay_out(
        tmp_path,
        {"/proc/self/limits": "Max locked memory  65536  65536  bytes\nMax nice  unlimited  0\n"},
    )
    assert limit(files, "Max locked memory") == 65536
    assert limit(files, "Max nice") == "unlimited"
    assert limit(files, "Max realtime priority") is None


def test_a_capability_is_one_bit(tmp_path: Path) -> None:
    files = lay_out(tmp_path, {"/proc/self/status": f"CapEff:\t{1 << 23:016x}\n"})
    assert has_capability(files, 23)
    assert not has_capability(files, 22)
    assert not has_capability(SystemFiles(tmp_path / "empty"), 23)


@pytest.mark.parametrize("controllers", ["cpu", "cpu,cpuacct"])
def test_the_group_of_the_cpu_controller_is_found(tmp_path: Path, controllers: str) -> None:
    path = f"/sys/fs/cgroup/{controllers}/robot/cpu.rt_runtime_us"
    files = lay_out(tmp_path, {"/proc/self/cgroup": f"2:{controllers}:/robot\n", path: "0"})
    assert cpu_group_file(files, "cpu.rt_runtime_us") == path


def test_governors_are_named_once_and_sorted(tmp_path: Path) -> None:
    named = {"cpu0": "powersave", "cpu1": "ondemand", "cpu10": "powersave"}
    contents = {
        f"/sys/devices/system/cpu/{cpu}/cpufreq/scaling_governor": f"{governor}\n"
        for cpu, governor in named.items()
    }
    assert governors(lay_out(tmp_path, contents)) == ["ondemand", "powersave"]
    assert online(lay_out(tmp_path, {"/sys/devices/system/cpu/online": "0-2,4\n"})) == 4


def test_other_processes_at_a_node_are_found_by_what_they_have_open(tmp_path: Path) -> None:
    files = raspberry_pi(tmp_path).files
    lay_out(tmp_path, {"/proc/412/comm": "i2cdetect\n", "/proc/413/comm": "bash\n"})
    link(tmp_path, "/proc/412/fd/3", tmp_path / "dev/i2c-1")
    link(tmp_path, "/proc/412/fd/4", "socket:[1234]")
    link(tmp_path, "/proc/413/fd/0", tmp_path / "dev/null")
    assert holders(files, ["/dev/i2c-1"]) == ([Holder(412, "i2cdetect", "/dev/i2c-1")], 0)


def test_a_node_is_the_same_under_another_name(tmp_path: Path) -> None:
    files = raspberry_pi(tmp_path).files
    lay_out(tmp_path, {"/proc/500/comm": "agetty\n"})
    link(tmp_path, "/proc/500/fd/0", tmp_path / "dev/ttyS0")
    assert holders(files, ["/dev/serial0"]).found == [Holder(500, "agetty", "/dev/serial0")]


def test_who_locks_a_node_is_told_from_who_only_has_it_open(tmp_path: Path) -> None:
    files = raspberry_pi(tmp_path).files
    lock = "pos:\t0\nlock:\t1: FLOCK  ADVISORY  WRITE 500 00:06:91 0 EOF\n"
    lay_out(tmp_path, {"/proc/500/comm": "run\n", "/proc/501/comm": "guard\n"})
    lay_out(tmp_path, {"/proc/500/fdinfo/3": lock, "/proc/501/fdinfo/3": "pos:\t0\n"})
    link(tmp_path, "/proc/500/fd/3", tmp_path / "dev/i2c-1")
    link(tmp_path, "/proc/501/fd/3", tmp_path / "dev/i2c-1")
    assert holders(files, ["/dev/i2c-1"]).found == [
        Holder(500, "run", "/dev/i2c-1", is_alone=True),
        Holder(501, "guard", "/dev/i2c-1", is_alone=False),
    ]


def test_a_process_that_hides_its_files_is_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = raspberry_pi(tmp_path).files
    lay_out(tmp_path, {"/proc/412/comm": "i2cdetect\n", "/proc/412/fd/marker": ""})

    def refuse(_folder: Path) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", refuse)
    assert holders(files, ["/dev/i2c-1"]) == ([], 1)
