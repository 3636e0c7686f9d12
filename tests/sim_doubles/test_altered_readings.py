"""A sensor on a serial line that lies: what it sends in place of what it measures, by kind."""

import re
from collections.abc import Sequence

import pytest

from firmware_runtime.devs.time import MILLISECOND, NEVER
from firmware_runtime.hal.strike import Span
from sim_doubles.altered_readings import OF_READINGS, AlteredReadings
from sim_doubles.chips.maxbotix import MaxbotixDouble
from sim_doubles.clock import ManualClock
from sim_doubles.serial_line import SerialLineDouble

MEASURED = (100, 101, 103, 102)
PERIOD = 100 * MILLISECOND
BEFORE_THE_SECOND = 300 * MILLISECOND


@pytest.mark.parametrize(
    ("kind", "sent"),
    [
        ("late", (99, 100, 101, 103)),
        ("freeze-axis", (99, 99, 99, 99)),
        ("offset", (130, 131, 133, 132)),
        ("scale", (200, 202, 206, 204)),
        ("full-scale", (1000, 1000, 1000, 1000)),
        ("noise", (109, 110, 121, 93)),
    ],
)
def test_each_kind_alters_what_is_measured(kind: str, sent: Sequence[int]) -> None:
    readings = AlteredReadings(0, 1000)
    assert readings.altered(99) == 99
    readings.break_(kind, once=False)
    assert tuple(map(readings.altered, MEASURED)) == sent
    readings.heal(kind)
    assert readings.altered(104) == 104


@pytest.mark.parametrize("kind", OF_READINGS)
def test_once_is_one_reading_and_what_was_never_measured_is_not_known(kind: str) -> None:
    readings = AlteredReadings(20, 765)
    readings.break_(kind, once=True)
    known = {"offset": 122, "scale": 200, "full-scale": 765}
    assert readings.altered(100) == known.get(kind, 100)
    assert readings.altered(100) == 100


def test_a_reading_stays_within_the_range_and_two_faults_are_both_made() -> None:
    readings = AlteredReadings(20, 765)
    readings.break_("scale", once=False)
    assert readings.altered(700) == 765
    readings.break_("offset", once=False)
    assert readings.altered(100) == 222


def distances(line: SerialLineDouble) -> list[int]:
    return [int(each) for each in re.findall(rb"R(\d+)", line.read_available())]


@pytest.mark.parametrize(
    ("span", "found"),
    [
        (
            Span(BEFORE_THE_SECOND, BEFORE_THE_SECOND + 2 * PERIOD, once=False),
            [100, 200, 200, 100, 100],
        ),
        (Span(BEFORE_THE_SECOND, NEVER, once=True), [100, 200, 100, 100, 100]),
        (Span(BEFORE_THE_SECOND, NEVER, once=False), [100, 200, 200, 200, 200]),
    ],
)
def test_a_sonar_lies_from_the_first_ping_after_that_instant_on(
    clock: ManualClock, span: Span, found: list[int]
) -> None:
    line = SerialLineDouble("sonar", clock, MaxbotixDouble(clock, lambda _at: 1.0))
    assert "scale" in line.fitting(None)
    line.strike("scale", None, span, 0.0)
    assert line.struck_at is None
    clock.advance(BEFORE_THE_SECOND + 5 * PERIOD)
    assert distances(line) == found
    assert line.struck_at is not None
    line.clear_strikes()
    clock.advance(2 * PERIOD)
    assert distances(line)[-1] == 100
