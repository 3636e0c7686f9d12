"""Clocks: what they count and when their waits end, never how exactly."""

import os
from collections.abc import Callable, Iterator
from functools import partial

import pytest

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.executive import clocks
from firmware_runtime.executive.clocks import MonotonicClock, ScaledClock, VirtualClock
from firmware_runtime.system import c_library


class Bell:
    """A source that is readable once rung."""

    def __init__(self) -> None:
        self.descriptor = os.eventfd(0)

    def fileno(self) -> int:
        return self.descriptor

    def ring(self) -> None:
        os.eventfd_write(self.descriptor, 1)


@pytest.fixture
def bell() -> Iterator[Bell]:
    made = Bell()
    yield made
    os.close(made.descriptor)


class Hardware:
    """Stands in for CLOCK_MONOTONIC, for select and for the alarm."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.instant = 5 * SECOND
        self.reading = 0
        self.alarms: list[int] = []
        monkeypatch.setattr(clocks, "monotonic_ns", self.read)
        monkeypatch.setattr(clocks, "select", self.select)
        monkeypatch.setattr(c_library, "Alarm", lambda: self)

    def read(self) -> int:
        self.instant += self.reading
        return self.instant

    def set(self, at: int) -> None:
        self.alarms.append(at)

    def select(
        self, sources: list[object], *_others: object
    ) -> tuple[list[object], list[object], list[object]]:
        if sources != [self]:
            return [], [], []
        self.instant = max(self.instant, self.alarms[-1])
        return [self], [], []


@pytest.fixture
def hardware(monkeypatch: pytest.MonkeyPatch) -> Hardware:
    return Hardware(monkeypatch)


def test_virtual_time_reaches_any_deadline_at_once_and_never_goes_back() -> None:
    clock = VirtualClock()
    clock.start(7)
    assert clock.now() == 7
    assert clock.wait(NEVER - 1, []) == []
    clock.wait(3, [])
    assert clock.now() == NEVER - 1


def test_virtual_time_stands_still_for_an_input(bell: Bell) -> None:
    clock = VirtualClock()
    bell.ring()
    assert clock.wait(SECOND, [bell]) == [bell]
    assert clock.now() == 0


def test_real_time_counts_from_the_start_of_the_run(hardware: Hardware) -> None:
    clock = MonotonicClock()
    hardware.instant += 3
    clock.start(100)
    hardware.instant += 20
    assert clock.now() == 120


def test_a_wait_is_for_the_deadline_however_long_it_takes_to_begin(hardware: Hardware) -> None:
    clock = MonotonicClock()
    clock.start(0)
    hardware.reading = 7
    assert clock.wait(10 * MILLISECOND, []) == []
    assert hardware.alarms == [5 * SECOND + 10 * MILLISECOND]


def test_a_deadline_that_has_passed_is_not_waited_for(hardware: Hardware) -> None:
    clock = MonotonicClock()
    clock.start(0)
    hardware.instant += SECOND
    assert clock.wait(10 * MILLISECOND, []) == []
    assert hardware.alarms == []


def test_a_late_loop_still_takes_its_inputs(bell: Bell) -> None:
    clock = MonotonicClock()
    clock.start(SECOND)
    bell.ring()
    assert clock.wait(0, [bell]) == [bell]


@pytest.mark.parametrize("make", [MonotonicClock, partial(ScaledClock, 0.001)])
def test_every_wait_has_a_bound(hardware: Hardware, make: Callable[[], MonotonicClock]) -> None:
    clock = make()
    clock.start(0)
    clock.wait(NEVER, [])
    assert hardware.alarms == [5 * SECOND + clocks.LONGEST_WAIT]


def test_an_input_ends_a_wait(bell: Bell) -> None:
    clock = MonotonicClock()
    clock.start(0)
    bell.ring()
    assert clock.wait(100 * SECOND, [bell]) == [bell]
    assert clock.now() < 100 * SECOND


def test_scaled_time_is_faster_by_its_speed(hardware: Hardware) -> None:
    clock = ScaledClock(2.5)
    clock.start(SECOND)
    hardware.instant += 4 * MILLISECOND
    assert clock.now() == SECOND + 10 * MILLISECOND
    clock.wait(SECOND + 35 * MILLISECOND, [])
    assert hardware.alarms == [5 * SECOND + 14 * MILLISECOND]
    assert clock.now() == SECOND + 35 * MILLISECOND


def test_a_scaled_wait_does_not_end_early_by_rounding(hardware: Hardware) -> None:
    clock = ScaledClock(3)
    clock.start(0)
    clock.wait(10, [])
    assert hardware.alarms == [5 * SECOND + 4]
    assert clock.now() >= 10


@pytest.mark.parametrize("speed", [0, -1, float("inf"), float("nan")])
def test_a_speed_that_is_none_is_refused(speed: float) -> None:
    with pytest.raises(ValueError, match="expected a positive number"):
        ScaledClock(speed)


def test_spinning_sleeps_short_of_the_deadline_and_looks_at_the_clock_up_to_it(
    hardware: Hardware,
) -> None:
    clock = MonotonicClock()
    clock.spin = 100_000
    clock.start(0)
    hardware.reading = 1_000
    clock.wait(MILLISECOND, [])
    assert hardware.alarms == [5 * SECOND + 900_000]
    assert clock.now() >= MILLISECOND


def test_spinning_begins_at_once_when_the_deadline_is_near(hardware: Hardware) -> None:
    clock = MonotonicClock()
    clock.spin = 100_000
    clock.start(0)
    hardware.reading = 1_000
    clock.wait(50_000, [])
    assert hardware.alarms == []
    assert clock.now() >= 50_000


def test_an_input_ends_a_wait_without_a_spin(bell: Bell) -> None:
    clock = MonotonicClock()
    clock.spin = 10 * SECOND
    clock.start(0)
    bell.ring()
    assert clock.wait(5 * SECOND, [bell]) == [bell]
    assert clock.now() < 5 * SECOND


@pytest.mark.usefixtures("hardware")
def test_a_wait_that_ends_at_its_bound_does_not_spin() -> None:
    clock = MonotonicClock()
    clock.spin = 100_000
    clock.start(0)
    clock.wait(SECOND, [])
    assert clock.now() == clocks.LONGEST_WAIT


def test_an_alarm_that_has_rung_is_no_source(bell: Bell) -> None:
    clock = MonotonicClock()
    clock.start(0)
    assert clock.wait(MILLISECOND, [bell]) == []
    assert clock.now() >= MILLISECOND
