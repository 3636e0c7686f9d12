import gc
import os
import signal
import threading
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.system.machine_counters import (
    TOO_HOT,
    UNDER_VOLTAGE,
    Continued,
    Supply,
    throttled_files,
    throttled_ns,
)
from firmware_runtime.system.thread_counters import (
    TICK_NS,
    Counted,
    Reading,
    ThreadCounters,
    between,
)
from tests.support.fake_machines import lay_out

STAT = """cpu  900 0 0 0 0 9 9 9 0 0
cpu1 30 0 20 400 5 {irq} {softirq} {steal} 0 0
cpu10 30 0 20 400 5 70 80 90 0 0
intr {interrupts} 0 0 12
ctxt 1234
"""
STATUS = "4711 (a name) 2) " + " ".join(str(field) for field in range(3, 53))
IO = "rchar: 1\nwchar: 2\nread_bytes: {read}\nwrite_bytes: {written}\n"


def reading(**parts: Any) -> Reading:  # noqa: ANN401 -- whatever the fields are
    nothing = Reading(0, (0, 0, 0, 0), frozenset({1}), 1, None, None, None, None, None, None, [])
    return nothing._replace(**parts)


def stat(irq: int, softirq: int, steal: int, interrupts: int) -> bytes:
    return STAT.format(irq=irq, softirq=softirq, steal=steal, interrupts=interrupts).encode()


def test_what_is_not_shown_is_not_measured_and_not_zero() -> None:
    counted = between(reading(), reading(cpu_ns=5))
    assert counted == Counted(cpu_ns=5, from_cpu=1, to_cpu=1)
    assert counted.run_delay_ns is counted.stolen_ns is counted.throttled_ns is None


def test_files_are_taken_apart_by_field() -> None:
    before = reading(
        schedule=b"100 2000 3\n",
        io=IO.format(read=4096, written=0).encode(),
        status=STATUS.encode(),
        machine=stat(1, 2, 3, 1000),
        frequency=b"1800000\n",
    )
    after = before._replace(
        cpu_ns=7,
        usage=(1, 2, 3, 4),
        schedule=b"190 5000 4\n",
        io=IO.format(read=8192, written=512).encode(),
        status=STATUS.replace(" 42 ", " 44 ").encode(),
        machine=stat(2, 4, 4, 1600),
        frequency=b"600000\n",
    )
    assert between(before, after) == Counted(
        cpu_ns=7,
        run_delay_ns=3000,
        minor_faults=1,
        major_faults=2,
        voluntary=3,
        involuntary=4,
        read_bytes=4096,
        written_bytes=512,
        disk_wait_ns=2 * TICK_NS,
        stolen_ns=TICK_NS,
        interrupt_ns=3 * TICK_NS,
        interrupts=600,
        from_cpu=1,
        to_cpu=1,
        khz_before=1_800_000,
        khz=600_000,
    )


def test_a_file_that_is_cut_short_is_not_measured() -> None:
    broken = reading(schedule=b"1", io=b"read", status=b"1 (x) S", machine=b"", frequency=b"?")
    assert between(broken, broken) == Counted(from_cpu=1, to_cpu=1)


def test_another_set_of_processors_is_a_move_and_another_processor_alone_is_none() -> None:
    assert not between(reading(), reading(cpu=0)).was_moved
    assert between(reading(), reading(allowed=frozenset({0}), cpu=0)).was_moved


def test_groups_add_up_and_one_without_a_figure_is_left_out() -> None:
    before = reading(groups=[b"throttled_usec 5\n", b"throttled_time 100\n", None])
    after = reading(groups=[b"throttled_usec 7\n", b"throttled_time 350\n", None])
    assert between(before, after).throttled_ns == 2000 + 250
    assert between(reading(groups=[None]), reading(groups=[b""])).throttled_ns is None


def test_nothing_is_read_where_nothing_is_shown(tmp_path: Path) -> None:
    counters = ThreadCounters(lay_out(tmp_path, {}))
    found = counters.read()
    assert found.schedule is found.machine is found.io is found.status is None
    assert found.groups == []
    assert counters.supply() is None
    counters.close()


@pytest.mark.parametrize(
    ("said", "is_traced"),
    [
        ("Name:\tx\nTracerPid:\t4711\nUid:\t0", True),
        ("Name:\tx\nTracerPid:\t0\nUid:\t0", False),
        ("", False),
    ],
)
def test_a_tracer_is_seen(tmp_path: Path, said: str, *, is_traced: bool) -> None:
    counters = ThreadCounters(lay_out(tmp_path, {"/proc/thread-self/status": said}))
    assert counters.is_traced() is is_traced
    counters.close()
    assert not counters.is_traced()


def test_this_machine_can_be_read_again_and_again_until_it_is_closed() -> None:
    gc.collect()  # what garbage of earlier tests has open is closed now, not while this one looks
    descriptors = len([*Path("/proc/self/fd").iterdir()])
    counters = ThreadCounters()
    first, second = counters.read(), counters.read()
    assert between(first, second).cpu_ns > 0
    counters.close()
    assert counters.read().machine is None
    assert len([*Path("/proc/self/fd").iterdir()]) == descriptors


def test_the_groups_of_a_process_are_its_own_and_those_above(tmp_path: Path) -> None:
    files = lay_out(
        tmp_path,
        {
            "/proc/self/cgroup": "3:cpu,cpuacct:/robots/tacho\n2:memory:/x\n0::/system.slice\n",
            "/proc/self/mounts": "none /sys/fs/cgroup/cpu cgroup rw,cpu,cpuacct 0 0\n"
            "none /sys/fs/cgroup/unified cgroup2 rw 0 0\nshort line\n",
            "/sys/fs/cgroup/cpu/robots/tacho/cpu.stat": "nr_periods 1\nthrottled_time 12\n",
            "/sys/fs/cgroup/cpu/robots/cpu.stat": "throttled_time 0\n",
            "/sys/fs/cgroup/cpu/cpu.stat": "nr_periods 1\n",
            "/sys/fs/cgroup/unified/system.slice/cpu.stat": "usage_usec 5\nthrottled_usec 3\n",
        },
    )
    assert throttled_files(files) == [
        "/sys/fs/cgroup/cpu/robots/tacho/cpu.stat",
        "/sys/fs/cgroup/cpu/robots/cpu.stat",
        "/sys/fs/cgroup/unified/system.slice/cpu.stat",
    ]


@pytest.mark.parametrize(
    ("content", "ns"),
    [
        (b"throttled_usec 3", 3000),
        (b"throttled_time 3", 3),
        (b"throttled_usec x", None),
        (None, None),
    ],
)
def test_both_versions_of_groups_say_how_long(content: bytes | None, ns: int | None) -> None:
    assert throttled_ns(content) == ns


def test_a_pi_says_what_holds_its_clock_down_now_and_not_what_once_did(tmp_path: Path) -> None:
    flags = "/sys/devices/platform/soc/soc:firmware/get_throttled"
    assert Supply(lay_out(tmp_path, {flags: "50008\n"}))() == TOO_HOT
    assert Supply(lay_out(tmp_path, {flags: "none\n"}))() is None


def test_without_the_firmware_the_voltage_monitor_is_asked(tmp_path: Path) -> None:
    monitor = "/sys/class/hwmon/hwmon1"
    files = lay_out(tmp_path, {f"{monitor}/name": "rpi_volt\n", f"{monitor}/in0_lcrit_alarm": "1"})
    assert Supply(files)() == UNDER_VOLTAGE
    assert Supply(lay_out(tmp_path, {f"{monitor}/name": "other\n"}))() is None


def test_going_on_after_a_stop_is_counted_and_the_signal_is_given_back() -> None:
    continued = Continued()
    os.kill(os.getpid(), signal.SIGCONT)
    continued.watch()
    os.kill(os.getpid(), signal.SIGCONT)
    assert continued.times == 1
    continued.unwatch()
    assert continued.times is None
    assert signal.getsignal(signal.SIGCONT) is signal.SIG_DFL


def test_the_handler_of_another_stays_and_nothing_is_counted() -> None:
    theirs: list[int] = []
    before = signal.signal(signal.SIGCONT, lambda number, _frame: theirs.append(number))
    try:
        continued = Continued()
        continued.watch()
        os.kill(os.getpid(), signal.SIGCONT)
        continued.unwatch()
    finally:
        signal.signal(signal.SIGCONT, before)
    assert theirs == [signal.SIGCONT]


def test_a_thread_that_may_not_handle_signals_counts_none() -> None:
    continued = Continued()
    thread = threading.Thread(target=continued.watch)
    thread.start()
    thread.join()
    assert continued.times is None
