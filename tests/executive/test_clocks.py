"""Clocks: what they count and when their waits end, never how exactly."""

import os
from collections.abc import Iterator

import pytest

from firmware_runtime.devs.time import MILLISECOND, NEVER, SECOND
from firmware_runtime.executive import clocks
from firmware_runtime.executive.clocks import MonotonicClock, ScaledClock, VirtualClock


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
    """Stands in for CLOCK_MONOTONIC and for select."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.instant = 5 * SECOND
        self.reading = 0
        self.slept: list[float] = []
        monkeypatch.setattr(clocks, "monotonic_ns", self.read)
        monkeypatch.setattr(clocks, "select", self.select)

    def read(self) -> int:
        self.instant += self.reading
        return self.instant

    def select(self, *arguments: object) -> tuple[list[object], list[object], list[object]]:
        timeout = arguments[3]
        assert isinstance(timeout, float | int)
        self.slept.append(timeout)
        self.instant += round(timeout * SECOND)
        return [], [], []


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


def test_a_wait_lasts_what_is_left_up_to_the_deadline(hardware: Hardware) -> None:
    clock = MonotonicClock()
    clock.start(0)
    hardware.instant += 4 * MILLISECOND
    clock.wait(10 * MILLISECOND, [])
    assert hardware.slept == [0.006]


def test_a_deadline_that_has_passed_is_not_waited_for(hardware: Hardware) -> None:
    clock = MonotonicClock()
    clock.start(0)
    hardware.instant += SECOND
    clock.wait(10 * MILLISECOND, [])
    assert hardware.slept == [0]


@pytest.mark.parametrize("clock", [MonotonicClock(), ScaledClock(0.001)], ids=["real", "scaled"])
def test_every_wait_has_a_bound(hardware: Hardware, clock: MonotonicClock) -> None:
    clock.start(0)
    clock.wait(NEVER, [])
    assert hardware.slept == [0.05]


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
    assert hardware.slept == [0.01]
    assert clock.now() == SECOND + 35 * MILLISECOND


def test_a_scaled_wait_does_not_end_early_by_rounding(hardware: Hardware) -> None:
    clock = ScaledClock(3)
    clock.start(0)
    clock.wait(10, [])
    assert hardware.slept == [4e-9]
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
    assert hardware.slept == [pytest.approx(0.0009, abs=1e-5)]
    assert clock.now() >= MILLISECOND


@pytest.mark.usefixtures("hardware")
def test_a_wait_that_ends_at_its_bound_does_not_spin() -> None:
    clock = MonotonicClock()
    clock.spin = 100_000
    clock.start(0)
    clock.wait(SECOND, [])
    assert clock.now() == clocks.LONGEST_WAIT
