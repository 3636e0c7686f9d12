"""The process of a run: its signals, and the settings that it was granted."""

import gc
import json
import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from select import select
from types import FrameType

import pytest
from msgspec.structs import fields

from firmware_runtime.devs.time import SECOND
from firmware_runtime.executive import process
from firmware_runtime.executive.clocks import MonotonicClock, VirtualClock
from firmware_runtime.executive.process import ProcessSettings, in_force
from firmware_runtime.statistics.file_header import NOT_ASKED, Request, RunState, Settings
from firmware_runtime.system.conditions import system_conditions
from firmware_runtime.system.signals import (
    ENDS,
    STOPS,
    signal_name,
    signal_number,
    stop_on_signals,
)
from tests.support.command import in_python
from tests.support.executives import Run
from tests.support.periodic_models import Robot
from tests.support.terminal import terminal_of
from tests.support.waiting import PATIENCE_S

HANDLED = (*STOPS, *ENDS)
BY_A_FAULT = {
    *(signal.SIGABRT, signal.SIGSEGV, signal.SIGBUS, signal.SIGFPE, signal.SIGILL),
    *(signal.SIGTRAP, signal.SIGSYS),
}
HALTS = {signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU}
IGNORED = {signal.SIGCHLD, signal.SIGCONT, signal.SIGURG, signal.SIGWINCH}


@pytest.mark.parametrize("number", HANDLED, ids=signal_name)
def test_a_signal_becomes_a_request_with_its_name(number: int) -> None:
    requests: list[str] = []
    before = signal.signal(number, signal.SIG_DFL)
    try:
        with stop_on_signals(requests.append, is_driving=True):
            os.kill(os.getpid(), number)
    finally:
        signal.signal(number, before)
    assert requests == [signal_name(number)]
    assert signal_number(requests[0]) == number


def test_every_signal_that_another_program_can_end_a_run_by_is_handled() -> None:
    """SIGKILL and SIGSTOP cannot be; Python itself ignores SIGPIPE and SIGXFSZ."""
    others = {signal.SIGKILL, signal.SIGSTOP, signal.SIGPIPE, signal.SIGXFSZ}
    assert set(signal.valid_signals()) - set(HANDLED) == BY_A_FAULT | HALTS | IGNORED | others


def test_what_was_installed_before_is_installed_again() -> None:
    before = [signal.getsignal(number) for number in signal.valid_signals()]
    with stop_on_signals(lambda _name: None, is_driving=True):
        assert [signal.getsignal(number) for number in signal.valid_signals()] != before
    assert [signal.getsignal(number) for number in signal.valid_signals()] == before


def test_a_signal_that_the_program_handles_stays_its_own() -> None:
    requests: list[str] = []
    taken: list[int] = []

    def take(number: int, _frame: FrameType | None) -> None:
        taken.append(number)

    before = signal.signal(signal.SIGUSR1, take)
    try:
        with stop_on_signals(requests.append, is_driving=True):
            os.kill(os.getpid(), signal.SIGUSR1)
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert (requests, taken) == ([], [signal.SIGUSR1])


def test_a_terminal_halts_nothing_that_drives() -> None:
    requests: list[str] = []
    with stop_on_signals(requests.append, is_driving=True):
        for number in HALTS:
            os.kill(os.getpid(), number)
    assert requests == ["SIGTSTP"]


def test_what_drives_nothing_may_be_halted_or_ended() -> None:
    others = {*HALTS, *ENDS}
    before = {number: signal.getsignal(number) for number in others}
    with stop_on_signals(lambda _name: None):
        assert {number: signal.getsignal(number) for number in others} == before


@pytest.mark.real_time
@pytest.mark.parametrize(("key", "name"), [(b"\x1a", "SIGTSTP"), (b"\x1c", "SIGQUIT")])
def test_a_key_of_the_terminal_ends_a_run_in_order(tmp_path: Path, key: bytes, name: str) -> None:
    words = ("run", "tachobot", "--doubles", "--statistics", str(tmp_path / "run.statistics"))
    shown = b""
    with terminal_of(sys.executable, "-m", "firmware_runtime.cli", *words) as (run, ours):
        while b" of 10 s" not in shown:  # the line of its progress
            shown += read(ours)
        os.write(ours, key)
        with suppress(OSError):  # what reading says once the other end is closed
            while piece := read(ours):
                shown += piece
        assert run.wait(PATIENCE_S) == 143
    assert name.encode() in shown


def read(terminal: int) -> bytes:
    assert select([terminal], (), (), PATIENCE_S)[0], "nothing is printed"
    return os.read(terminal, 4096)


def test_a_signal_ends_a_wait_that_would_have_lasted() -> None:
    robot = Robot(imu=1000 * SECOND)
    run = Run(robot, MonotonicClock())
    robot.thrust.work = lambda _value: os.kill(os.getpid(), signal.SIGTERM)
    with stop_on_signals(run.executive.request_stop):
        outcome = run.until(1000 * SECOND)
    assert (outcome.state, outcome.reason) == (RunState.STOPPED, "SIGTERM")
    assert run.made_safe == 2
    assert run.json()["conditions"]["run"]["state"] == "stopped"


EVERYTHING = ProcessSettings(
    fifo_priority=10,
    lock_memory=True,
    cpus=(0,),
    timer_slack_ns=1,
    freeze_garbage=True,
    spin_us=20.0,
    keep_cpu_awake=True,
)
PROGRAM = """
import gc, json, os, re
from msgspec import to_builtins
from firmware_runtime.executive.clocks import MonotonicClock
from firmware_runtime.executive.process import in_force
from tests.executive.test_process import EVERYTHING

def held():
    with open("/proc/self/status") as status:
        locked = int(re.search(r"VmLck:\\s+(\\d+)", status.read())[1]) > 0
    with open("/proc/self/timerslack_ns") as slack:
        return {
            "scheduler": os.sched_getscheduler(0), "locked": locked, "slack": int(slack.read()),
            "cpus": sorted(os.sched_getaffinity(0)), "collects": gc.isenabled(),
            "frozen": gc.get_freeze_count() > 0, "descriptors": len(os.listdir("/proc/self/fd")),
        }

before = held()
with in_force(EVERYTHING, MonotonicClock()) as granted:
    during = held()
print(json.dumps([to_builtins(granted), before, during, held()]))
"""


@pytest.mark.slow
def test_what_is_reported_as_granted_holds_and_is_undone() -> None:
    answer = in_python(PROGRAM, check=True, cwd=Path(__file__).parents[2])
    granted, before, during, after = json.loads(answer.stdout)
    assert (during["frozen"], after.pop("frozen")) == (True, False)
    before.pop("frozen")  # some releases of Python freeze a few objects of their own
    assert after == before
    if granted["fifo_priority"]["granted"]:
        assert during["scheduler"] == os.SCHED_FIFO
    assert during["locked"] == granted["lock_memory"]["granted"]
    assert during["cpus"] == [0] or not granted["cpus"]["granted"]
    assert during["slack"] <= 1 or not granted["timer_slack_ns"]["granted"]
    assert granted["freeze_garbage"]["granted"]
    assert during["collects"] is False
    for each in granted.values():
        assert each["granted"] or each["reason"]


def report(settings: ProcessSettings) -> Settings:
    with in_force(settings, MonotonicClock()) as granted:
        return granted


def test_every_setting_is_reported() -> None:
    assert set(report(ProcessSettings())) == {each.name for each in fields(ProcessSettings)}


def test_nothing_asked_for_changes_nothing() -> None:
    before = os.sched_getscheduler(0), os.sched_getaffinity(0), gc.isenabled()
    with in_force(ProcessSettings(), MonotonicClock()) as granted:
        assert before == (os.sched_getscheduler(0), os.sched_getaffinity(0), gc.isenabled())
    assert {each.reason for each in granted.values()} == {"not asked for"}
    assert not any(each.granted for each in granted.values())


def test_virtual_time_takes_nothing_from_other_processes() -> None:
    with in_force(EVERYTHING, VirtualClock()) as granted:
        assert gc.isenabled()
    assert {each.reason for each in granted.values()} == {"virtual time waits for nothing"}


def test_a_refusal_says_what_would_be_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_arguments: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert report(ProcessSettings(fifo_priority=10))["fifo_priority"] == Request(
        asked=10,
        granted=False,
        reason="Operation not permitted; needs CAP_SYS_NICE, or LimitRTPRIO= of the unit",
    )


def test_a_kernel_that_says_yes_and_does_no_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_setscheduler", lambda *_arguments: None)
    answer = report(ProcessSettings(fifo_priority=10))["fifo_priority"]
    assert answer.granted is False
    assert answer.reason == "the kernel kept another scheduling class"


@pytest.mark.parametrize(
    "settings",
    [
        ProcessSettings(fifo_priority=1000),
        ProcessSettings(cpus=(100_000,)),
        ProcessSettings(cpus=(-1,)),
    ],
)
def test_what_makes_no_sense_is_not_granted_and_does_not_end_the_run(
    settings: ProcessSettings,
) -> None:
    asked = [each for each in report(settings).values() if each.reason != NOT_ASKED]
    assert [each.granted for each in asked] == [False]


def test_an_absent_device_is_not_granted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(process, "CPU_DMA_LATENCY", tmp_path / "absent")
    answer = report(ProcessSettings(keep_cpu_awake=True))["keep_cpu_awake"]
    assert answer.granted is False
    assert "No such file" in (answer.reason or "")


def test_scheduling_and_processors_are_for_the_run_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a table in the kernel's place, for a mutant would set what another process has."""
    cpus, kinds = {0: {0, 1}}, {0: (os.SCHED_OTHER, os.sched_param(0))}
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: cpus[pid])
    monkeypatch.setattr(os, "sched_setaffinity", lambda pid, to: cpus.update({pid: set(to)}))
    monkeypatch.setattr(os, "sched_getscheduler", lambda pid: kinds[pid][0])
    monkeypatch.setattr(os, "sched_getparam", lambda pid: kinds[pid][1])
    monkeypatch.setattr(os, "sched_setscheduler", lambda pid, *to: kinds.update({pid: to}))
    with in_force(ProcessSettings(fifo_priority=10, cpus=(1,)), MonotonicClock()) as granted:
        assert (cpus, kinds) == ({0: {1}}, {0: (os.SCHED_FIFO, os.sched_param(10))})
    assert granted["fifo_priority"].granted
    assert granted["cpus"].granted
    assert (cpus, kinds) == ({0: {0, 1}}, {0: (os.SCHED_OTHER, os.sched_param(0))})


def test_the_timer_slack_is_for_the_run_only() -> None:
    slack = Path("/proc/self/timerslack_ns")
    slack.write_text("70000")
    try:
        with in_force(ProcessSettings(timer_slack_ns=1), MonotonicClock()) as granted:
            assert (granted["timer_slack_ns"].granted, slack.read_text()) == (True, "1\n")
        assert slack.read_text() == "70000\n"
    finally:
        slack.write_text("0")


def test_garbage_is_frozen_and_left_alone_for_the_run_only(monkeypatch: pytest.MonkeyPatch) -> None:
    collected: list[int] = []
    monkeypatch.setattr(gc, "collect", lambda: collected.append(gc.get_freeze_count()))
    with in_force(ProcessSettings(freeze_garbage=True), MonotonicClock()) as granted:
        assert granted["freeze_garbage"].granted
        assert [gc.get_freeze_count() > before for before in collected] == [True]
        assert not gc.isenabled()
    assert (gc.get_freeze_count(), gc.isenabled()) == (0, True)


def test_processors_are_kept_awake_by_a_latency_of_zero(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    device = tmp_path / "cpu_dma_latency"
    device.touch()
    monkeypatch.setattr(process, "CPU_DMA_LATENCY", device)
    assert report(ProcessSettings(keep_cpu_awake=True))["keep_cpu_awake"].granted
    assert device.read_bytes() == bytes(4)


def test_spinning_is_for_the_run_only() -> None:
    clock = MonotonicClock()
    with in_force(ProcessSettings(spin_us=20), clock) as granted:
        assert clock.spin == 20_000
    assert clock.spin == 0
    assert granted["spin_us"] == Request(asked=20, granted=True, reason=None)


def test_conditions_are_complete_and_can_be_written_as_json() -> None:
    conditions = system_conditions()
    assert json.loads(json.dumps(conditions)) == conditions
    assert conditions["scheduler"] == "SCHED_OTHER"
    assert conditions["kernel"].startswith("Linux ")
    assert conditions["versions"]["numpy"] is not None
