import math

import pytest
from firmware_drivers.chips.md25 import Md25Report
from firmware_drivers.treads import Treads, TreadSpeeds

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import SettingError
from tests.support.atomic_bench import AtomicBench
from tests.support.scripted_treads import ScriptedDriver, bench_of, settings

REPORT = Md25Report(1, 2, 12.0, 0.1, 0.2)


@pytest.fixture
def driver() -> ScriptedDriver:
    return ScriptedDriver()


@pytest.fixture
def bench(driver: ScriptedDriver) -> AtomicBench:
    return bench_of(driver, settings())


# Commands -----------------------------------------------------------------------------------------


def test_nothing_turns_until_it_is_commanded(bench: AtomicBench, driver: ScriptedDriver) -> None:
    bench.run(5000)
    assert driver.driven == []
    assert bench.model.phase == "still"


@pytest.mark.parametrize(
    ("right", "left", "driven"),
    [(1, 1, (0.5, 0.5)), (1, 2, (-0.5, 0.5)), (2, 1, (0.5, -0.5)), (2, 2, (-0.5, -0.5))],
)
def test_signals_of_one_instant_are_one_write(
    bench: AtomicBench,
    driver: ScriptedDriver,
    right: int,
    left: int,
    driven: tuple[float, float],
) -> None:
    bench.put(50, right=right, left=left)
    bench.run(60)
    assert driver.driven == [(driven, 50)]


def test_a_signal_for_one_side_leaves_the_other_as_it_is(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    bench.put(50, right=1, left=2)
    bench.put(100, left=1)
    bench.put(150, right=0)
    bench.run(160)
    assert [call for call, _ in driver.driven] == [(-0.5, 0.5), (0.5, 0.5), (0.5, 0.0)]


def test_moving_treads_are_refreshed_and_standing_ones_left_alone(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    bench.put(50, right=1, left=1)
    bench.put(500, right=0, left=0)
    bench.run(5000)
    assert driver.driven == [
        ((0.5, 0.5), 50),
        ((0.5, 0.5), 250),
        ((0.5, 0.5), 450),
        ((0.0, 0.0), 500),
    ]


def test_a_command_puts_the_next_refresh_off(bench: AtomicBench, driver: ScriptedDriver) -> None:
    bench.put(50, right=1)
    bench.put(240, left=1)
    bench.run(445)
    assert [at for _, at in driver.driven] == [50, 240, 440]


@pytest.mark.parametrize(
    ("speeds", "driven"),
    [((0.25, -0.75), (0.25, -0.75)), ((2.0, -7.0), (1.0, -1.0))],
)
def test_speeds_are_taken_as_they_are_and_clipped(
    bench: AtomicBench,
    driver: ScriptedDriver,
    speeds: tuple[float, float],
    driven: tuple[float, float],
) -> None:
    bench.put(50, speeds=TreadSpeeds(*speeds))
    bench.run(60)
    assert driver.driven == [(driven, 50)]


def test_a_signal_goes_before_speeds_for_its_own_side(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    bench.put(50, speeds=TreadSpeeds(0.1, 0.1), left=2)
    bench.run(60)
    assert driver.driven == [((-0.5, 0.1), 50)]


def test_a_reversed_motor_is_driven_the_other_way(driver: ScriptedDriver) -> None:
    bench = bench_of(driver, settings(left_reversed=True))
    bench.put(50, right=1, left=1)
    bench.put(60, right=1, left=0)
    bench.run(70)
    assert [call for call, _ in driver.driven] == [(-0.5, 0.5), (0.0, 0.5)]


def test_a_command_during_bring_up_is_kept(bench: AtomicBench, driver: ScriptedDriver) -> None:
    bench.put(3, right=1)
    bench.put(5, left=1)
    bench.run(60)
    assert driver.driven == [((0.5, 0.5), 10)]


def test_a_command_at_the_instant_of_a_refresh_is_written_last(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    bench.put(50, right=1, left=1)
    bench.collide(250, right=0, left=0)
    bench.run(1000)
    assert driver.driven[-1] == ((0.0, 0.0), 250)
    assert bench.model.phase == "still"


def test_what_the_driver_says_is_sent_with_each_write(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    driver.drives = [REPORT]
    bench.put(50, right=1)
    bench.run(449)
    assert bench.said["report"] == [(50, REPORT), (250, REPORT)]


# Settings -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"speed": 0.0}, "speed: 0.0, expected more than 0, 1 at most"),
        ({"speed": math.nan}, "speed: nan"),
        ({"refresh": 501 * MILLISECOND}, "refresh: 501 ms, expected more than 0, at most 500 ms"),
        ({"refresh": 0}, "refresh: 0 ms"),
        ({"command_timeout": 0}, "command_timeout: 0 ns, expected more than 0"),
    ],
)
def test_a_setting_that_cannot_be_is_refused(
    driver: ScriptedDriver, changes: dict[str, object], fault: str
) -> None:
    with pytest.raises(SettingError, match=f"treads on scripted chip: {fault}"):
        Treads("treads", driver, settings(**changes))
