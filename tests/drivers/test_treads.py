import math

import pytest
from firmware_drivers.chips.md25 import Md25Report
from firmware_drivers.treads import Treads

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.errors import SettingError
from tests.support.scripted_treads import ScriptedDriver, TreadsBench, bench_of, settings
from tests.support.wire import sentences

REPORT = Md25Report(1, 2, 12.0, 0.1, 0.2)


@pytest.fixture
def driver() -> ScriptedDriver:
    return ScriptedDriver()


@pytest.fixture
def bench(driver: ScriptedDriver) -> TreadsBench:
    return bench_of(driver, settings())


# Commands -----------------------------------------------------------------------------------------


@sentences(
    {
        "nothing turns until it is commanded": "5000; driven is (); phase is still",
        "both sides are one write": "50 right=1 left=1; driven is 50:0.5/0.5",
        "a turn to the left": "50 right=1 left=2; driven is 50:-0.5/0.5",
        "a turn to the right": "50 right=2 left=1; driven is 50:0.5/-0.5",
        "both astern": "50 right=2 left=2; driven is 50:-0.5/-0.5",
        "a signal for one side leaves the other as it is": (
            "50 right=1 left=2; 100 left=1; 150 right=0; "
            "driven is 50:-0.5/0.5 100:0.5/0.5 150:0.5/0"
        ),
        "a command puts the next refresh off": (
            "50 right=1; 240 left=1; 445; driven is 50:0/0.5 240:0.5/0.5 440:0.5/0.5"
        ),
        "speeds are taken as they are": "50 speeds=(0.25,-0.75); driven is 50:0.25/-0.75",
        "speeds are clipped": "50 speeds=(2.0,-7.0); driven is 50:1/-1",
        "a signal goes before speeds for its own side": (
            "50 speeds=(0.1,0.1) left=2; driven is 50:-0.5/0.1"
        ),
        "a command during bring-up is kept": "3 right=1; 5 left=1; 60; driven is 10:0.5/0.5",
        "moving treads are refreshed and standing ones left alone": (
            "50 right=1 left=1; 500 right=0 left=0; 5000; "
            "driven is 50:0.5/0.5 250:0.5/0.5 450:0.5/0.5 500:0/0; phase is still"
        ),
    }
)
def test_commands_are_driven(bench: TreadsBench, lines: str) -> None:
    bench.play(lines)


def test_a_reversed_motor_is_driven_the_other_way(driver: ScriptedDriver) -> None:
    bench = bench_of(driver, settings(left_reversed=True))
    bench.play("50 right=1 left=1; 60 right=1 left=0; driven is 50:-0.5/0.5 60:0/0.5")


def test_a_command_at_the_instant_of_a_refresh_is_written_last(
    bench: TreadsBench, driver: ScriptedDriver
) -> None:
    bench.put(50, right=1, left=1)
    bench.collide(250, right=0, left=0)
    bench.run(1000)
    assert driver.driven[-1] == ((0.0, 0.0), 250)
    assert bench.model.phase == "still"


def test_what_the_driver_says_is_sent_with_each_write(
    bench: TreadsBench, driver: ScriptedDriver
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
