"""How often a healthy robot uses its buses, and what its board states of it."""

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.hal.budget import BusLoad, PeriodicTransaction
from firmware_runtime.hal.strike import Use
from firmware_runtime.lab.campaign.rates import off_pace
from firmware_runtime.lab.campaign.watched import EVERY

ON = [True] * (2 * SECOND // EVERY)


def load(*periods_ms: float) -> dict[str, BusLoad]:
    """A bus on which so many transactions recur, each with its period."""
    each = [PeriodicTransaction("sample", (b"0",), round(ms * MILLISECOND)) for ms in periods_ms]
    return {"i2c1": BusLoad("i2c1", 400_000, each)}


def used(every_ms: float, until: int = 2 * SECOND) -> list[tuple[str, Use]]:
    """Uses of that bus, one every so often."""
    instants = range(0, until, round(every_ms * MILLISECOND))
    return [("i2c1", Use(at, 0x68, reads=True, writes=False)) for at in instants]


@pytest.mark.parametrize("every_ms", [9.0, 10.0, 11.0])
def test_a_bus_that_is_used_about_as_often_as_its_board_states_is_not_off_pace(
    every_ms: float,
) -> None:
    assert off_pace(load(10), used(every_ms), ON) is None


@pytest.mark.parametrize(
    ("every_ms", "says"),
    [
        (20.0, "it has 50 transactions a second at the most, and 100 by its board's loads"),
        (5.0, "it has 200 transactions a second at the least, and 100 by its board's loads"),
    ],
)
def test_a_bus_that_is_used_half_or_twice_as_often_is_off_pace(every_ms: float, says: str) -> None:
    assert off_pace(load(10), used(every_ms), ON) == ("i2c1", says)
    assert off_pace(load(20, 20), used(every_ms), ON) == ("i2c1", says)


def test_a_second_as_it_is_stated_is_enough() -> None:
    assert off_pace(load(10), used(10, SECOND), ON) is None
    assert off_pace(load(10), used(10, SECOND // 2), ON) is not None


def test_a_board_that_states_nothing_or_a_robot_that_is_off_is_not_judged() -> None:
    assert off_pace(load(), used(5.0), ON) is None
    assert off_pace({}, used(5.0), ON) is None
    assert off_pace(load(10), used(5.0), ON[: SECOND // EVERY - 1]) is None
    assert off_pace(load(10), used(5.0), [not k % 5 for k in range(len(ON))]) is None


def test_what_seldom_recurs_may_be_there_once_more_or_once_less() -> None:
    assert off_pace(load(500), used(1000), ON) is None
    assert off_pace(load(500), used(300), ON) is None
    assert off_pace(load(500), used(200), ON) is not None
