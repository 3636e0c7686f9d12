"""The alarm rings at its instant, never before; one that is set again has not rung."""

import gc
import os
from select import select
from time import monotonic_ns

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.system.c_library import Alarm
from tests.support.waiting import PATIENCE_S


def has_rung(alarm: Alarm) -> bool:
    return select([alarm], (), (), 0)[0] == [alarm]


def test_it_rings_and_not_before_its_instant() -> None:
    alarm = Alarm()
    at = monotonic_ns() + 2 * MILLISECOND
    alarm.set(at)
    assert select([alarm], (), (), PATIENCE_S)[0] == [alarm]
    assert monotonic_ns() >= at


def test_an_instant_that_has_passed_rings_at_once() -> None:
    alarm = Alarm()
    alarm.set(1)
    assert select([alarm], (), (), PATIENCE_S)[0] == [alarm]


def test_an_alarm_set_again_has_not_rung() -> None:
    alarm = Alarm()
    alarm.set(1)
    alarm.set(monotonic_ns() + 100 * SECOND)
    assert not has_rung(alarm)


def test_an_alarm_never_set_does_not_ring() -> None:
    assert not has_rung(Alarm())


def test_an_instant_before_the_clock_s_first_is_refused() -> None:
    with pytest.raises(OSError, match="Invalid argument"):
        Alarm().set(-SECOND)


def test_its_descriptor_goes_with_it() -> None:
    descriptor = Alarm().fileno()
    gc.collect()
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(descriptor)
