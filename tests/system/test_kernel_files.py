"""What the readers of /proc, /sys and the kernel's trace make of several machines."""

import os
from pathlib import Path

import pytest

from firmware_runtime.statistics.ran_instead import RanInstead, ran_instead
from firmware_runtime.system import switch_trace as module
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
from firmware_runtime.system.switch_trace import (
    NoTracingError,
    Switch,
    Thread,
    switch_trace,
    switches,
)
from tests.support.command import in_python
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


LOOP = 4711
TEXT = """\
# tracer: nop
#           TASK-PID     CPU#  |||||  TIMESTAMP  FUNCTION
          <idle>-0       [001] d..2.    10.000010: sched_switch: prev_comm=swapper/1 prev_pid=0 \
prev_prio=120 prev_state=R ==> next_comm=stress -c 1 next_pid=900 next_prio=19
          <idle>-0       [000] d.h3.    10.001000: sched_waking: comm=python pid=4711 prio=49 \
target_cpu=001
     stress -c 1-900     [001] d..2.    10.004000: sched_switch: prev_comm=stress -c 1 \
prev_pid=900 prev_prio=19 prev_state=S ==> next_comm=kworker/1:0 next_pid=33 next_prio=120
     kworker/1:0-33      [001] d..2.    10.004100: sched_switch: prev_comm=kworker/1:0 \
prev_pid=33 prev_prio=120 prev_state=R+ ==> next_comm=python next_pid=4711 next_prio=49
CPU:1 [LOST 12 EVENTS]
          python-4711    [001] d..2.    10.004600: sched_switch: prev_comm=python prev_pid=4711 \
prev_prio=49 prev_state=S ==> next_comm=swapper/1 next_pid=0 next_prio=120
"""
US = 1000
AT = 10_000_000_000


def traced() -> list[Switch]:
    return switches(TEXT.splitlines())


def test_switches_and_wakings_are_read_and_other_lines_left_out() -> None:
    found = traced()
    assert [each.at - AT for each in found] == [10 * US, 1000 * US, 4000 * US, 4100 * US, 4600 * US]
    assert found[1] == Switch(AT + 1000 * US, 0)
    assert found[0].to == Thread("stress -c 1", 900, 19)
    assert found[3].still_could
    assert not found[4].still_could


def test_what_the_processor_ran_from_the_waking_on_ran_instead() -> None:
    assert ran_instead(traced(), LOOP, AT, AT + 5000 * US) == [
        RanInstead("stress -c 1", 900, "FIFO or RR 80", 1, 3000.0),
        RanInstead("kworker/1:0", 33, "nice 0", 1, 100.0),
    ]


def test_only_what_lies_between_the_instants_counts() -> None:
    (found,) = ran_instead(traced(), LOOP, AT + 2000 * US, AT + 3000 * US)
    assert (found.pid, found.us) == (900, 1000.0)


def test_a_thread_that_lost_its_processor_waits_from_then_on() -> None:
    loop, other, swift = Thread("python", LOOP, 120), Thread("make", 5, 100), Thread("sh", 8, 120)
    lost = [
        Switch(1 * US, 0, still_could=True, before=loop, to=other),
        Switch(4 * US, 0, still_could=True, before=other, to=swift),
        Switch(4 * US, 0, still_could=True, before=swift, to=other),
        Switch(9 * US, 0, still_could=True, before=other, to=loop),
    ]
    assert ran_instead(lost, LOOP, 0, 20 * US) == [RanInstead("make", 5, "nice -20", 0, 8.0)]


def test_what_another_processor_ran_meanwhile_ran_beside_it() -> None:
    loop, other, beside = Thread("python", LOOP, 120), Thread("irq", 5, 0), Thread("dd", 6, 120)
    lost = [
        Switch(1 * US, 0, still_could=True, before=loop, to=other),
        Switch(2 * US, 1, before=beside, to=other),
        Switch(3 * US, 0),
        Switch(4 * US, 1, before=other, to=beside),
        Switch(9 * US, 0, before=other, to=loop),
    ]
    assert ran_instead(lost, LOOP, 0, 20 * US) == [RanInstead("irq", 5, "FIFO or RR 99", 0, 8.0)]


def test_one_that_slept_waited_for_nothing() -> None:
    loop, other = Thread("python", LOOP, 120), Thread("make", 5, 125)
    slept = [
        Switch(1 * US, 0, before=loop, to=other),
        Switch(9 * US, 0, before=other, to=loop),
    ]
    assert ran_instead(slept, LOOP, 0, 20 * US) == []


def test_a_stretch_in_which_a_switch_was_lost_is_nobodys() -> None:
    loop, make, idle = Thread("python", LOOP, 120), Thread("make", 5, 125), Thread("idle", 0, 120)
    lost = [
        Switch(1 * US, 0, before=make, to=idle),
        Switch(2 * US, 1),
        Switch(8 * US, 0, before=make, to=loop),
    ]
    assert ran_instead(lost, LOOP, 0, 20 * US) == []


def test_an_idle_processor_is_said_to_have_done_nothing() -> None:
    idle = RanInstead("swapper/1", 0, "idle", 1, 2500.0)
    assert idle.text() == "nothing 2.50 ms on CPU 1"
    assert RanInstead("dd", 7, "deadline", 0, 5.0).text() == "dd (7, deadline) 5.0 us on CPU 0"


@pytest.fixture
def tracefs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder like tracefs, but that a new instance is empty."""
    (tmp_path / "instances").mkdir()
    monkeypatch.setattr(module, "PLACES", (tmp_path,))
    return tmp_path


def test_what_killed_processes_left_on_is_removed(tracefs: Path) -> None:
    left_over = tracefs / "instances" / "firmware-runtime-999999999"
    left_over.mkdir()
    mine = tracefs / "instances" / f"firmware-runtime-{os.getppid()}"
    mine.mkdir()
    with pytest.raises(NoTracingError), switch_trace(LOOP):
        pytest.fail("an instance without events cannot be switched on")
    assert not left_over.exists()
    assert mine.exists()


def test_an_instance_that_cannot_be_switched_on_is_refused_in_a_sentence(tracefs: Path) -> None:
    with pytest.raises(NoTracingError, match="expected root, or tracefs") as refused:
        switch_trace(LOOP).__enter__()
    assert str(tracefs) in str(refused.value)


_TRACED = """
import os, sys, time
from firmware_runtime.system.switch_trace import NoTracingError, switch_trace
try:
    with switch_trace(os.getpid()) as trace:
        instance = trace._trace.parent
        began = time.monotonic_ns()
        time.sleep(0.01)
        ended = time.monotonic_ns()
        found = trace.read()
except NoTracingError as error:
    print(error)
    sys.exit(3)
left = [each for each in found if each.before is not None and each.before.pid == os.getpid()]
woken = [each for each in found if each.to is None]
slack = 1_000_000
print(any(began - slack <= each.at <= ended + slack for each in left), bool(woken))
print(instance.exists())
"""


# It sleeps and is woken. That it was taken up again is not asked for: kernels of some virtual
# machines trace no switch from an idle processor.
@pytest.mark.slow
@pytest.mark.real_time
def test_the_kernels_own_trace_has_the_switches_of_this_process_and_ends_with_it() -> None:
    done = in_python(_TRACED)
    if done.returncode == 3:
        pytest.skip(f"root's right to tracefs: {done.stdout.strip()}")
    assert (done.stdout.split(), done.stderr) == (["True", "True", "False"], "")
