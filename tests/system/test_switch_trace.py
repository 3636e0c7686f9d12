"""What the kernel's text says, and what ran while a thread waited. Tracing itself takes root."""

import os
from pathlib import Path

import pytest

from firmware_runtime.statistics.ran_instead import RanInstead, ran_instead
from firmware_runtime.system import switch_trace as module
from firmware_runtime.system.switch_trace import (
    NoTracingError,
    Switch,
    Thread,
    switch_trace,
    switches,
)
from tests.support.command import in_python

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
    loop, other = Thread("python", LOOP, 120), Thread("make", 5, 125)
    lost = [
        Switch(1 * US, 0, still_could=True, before=loop, to=other),
        Switch(9 * US, 0, still_could=True, before=other, to=loop),
    ]
    assert ran_instead(lost, LOOP, 0, 20 * US) == [RanInstead("make", 5, "nice 5", 0, 8.0)]


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
