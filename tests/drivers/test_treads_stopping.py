import math
import re

import pytest
from firmware_drivers.motors import FAULTS_BEFORE_FORGETTING
from firmware_drivers.treads import TreadSpeeds

from firmware_runtime.devs.time import MILLISECOND
from tests.support.scripted_chip import SILENT
from tests.support.scripted_treads import STOP, ScriptedDriver, TreadsBench, bench_of, settings
from tests.support.wire import sentences


@pytest.fixture
def driver() -> ScriptedDriver:
    return ScriptedDriver()


@pytest.fixture
def bench(driver: ScriptedDriver) -> TreadsBench:
    return bench_of(driver, settings())


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ({"left": 3}, r"treads\.left: signal 3, expected 0, 1 or 2"),
        ({"right": -1}, r"treads\.right: signal -1"),
        ({"speeds": TreadSpeeds(math.nan, 0.0)}, r"treads\.speeds: speeds \(nan, 0\.0\); expected"),
        ({"speeds": TreadSpeeds(0.0, math.inf)}, r"expected finite numbers"),
    ],
)
def test_a_command_that_is_none_stops_both_and_says_why(
    bench: TreadsBench, driver: ScriptedDriver, command: dict[str, object], reason: str
) -> None:
    bench.put(50, right=1, left=1)
    bench.put(60, **command)
    bench.run(1000)
    assert driver.driven[1:] == [(STOP, 60)]
    (fault,) = bench.faults
    assert fault.kind == "NotReady"
    assert re.search(reason, fault.reason)
    assert bench.model.phase == "still"


AHEAD = "50 right=1 left=1"


@sentences(
    {
        "a good command is obeyed after one that was none": (
            "50 left=3; 60 left=1; 70; driven is 50:stop 60:0.5/0; steps is 0; consecutive is 1"
        ),
        "a chip that did not take the stop of a bad command is brought up again": (
            "stops x.; 50 left=3; 200; driven is 50:stop 100:stop; steps is 0 100; "
            "consecutive is 1 2"
        ),
        "a write that fails stops at once and is repeated once the chip is up": (
            f"drives .x.; {AHEAD}; 300; steps is 0 250; consecutive is 1; "
            "driven is 50:0.5/0.5 250:0.5/0.5 250:stop 260:0.5/0.5; phase is driving"
        ),
        "a stop is repeated until acknowledged and then the chip brought up": (
            f"drives .x.; stops xx.; {AHEAD}; 365; steps is 0 350; consecutive is 1 2 3; "
            "driven is 50:0.5/0.5 250:0.5/0.5 250:stop 300:stop 350:stop 360:0.5/0.5"
        ),
        "a command while the stop is pending is obeyed after it": (
            f"drives .x.; stops x.; {AHEAD}; 270 right=2; 400; steps is 0 300; consecutive is 1 2; "
            "driven is 50:0.5/0.5 250:0.5/0.5 250:stop 300:stop 310:0.5/-0.5"
        ),
        "commands are obeyed again after a fault": (
            f"drives x.; {AHEAD}; 100 right=1 left=1; 150; steps is 0 50; consecutive is 1; "
            "driven is 50:0.5/0.5 50:stop 60:0.5/0.5 100:0.5/0.5"
        ),
        "two commands taken end a row of faults": (
            f"drives .x..x.; {AHEAD}; 700; steps is 0 250 660; consecutive is 1 1; "
            "driven is 50:0.5/0.5 250:0.5/0.5 250:stop 260:0.5/0.5 460:0.5/0.5 660:0.5/0.5 "
            "660:stop 670:0.5/0.5"
        ),
    }
)
def test_stops_and_what_follows(bench: TreadsBench, lines: str) -> None:
    bench.play(lines)


def test_a_chip_that_resets_whenever_it_drives_is_given_up_until_a_new_command(
    bench: TreadsBench, driver: ScriptedDriver
) -> None:
    """As a supply does that cannot feed the motors: each command is taken once, and then lost."""
    driver.drives = [*([None, SILENT] * FAULTS_BEFORE_FORGETTING), None]
    bench.put(50, right=1, left=1)
    bench.run(19_000)
    consecutive = [fault.consecutive for _, fault in bench.said["fault"]]
    assert consecutive == list(range(1, FAULTS_BEFORE_FORGETTING + 1))
    assert bench.model.phase == "still"
    assert driver.driven[-1][0] == STOP
    bench.put(19_000, right=2)
    bench.run(20_000)
    assert bench.model.phase == "driving"
    *_, (last, _) = driver.driven
    assert last == (0.0, -0.5)


def test_a_command_is_not_repeated_beyond_its_timeout(driver: ScriptedDriver) -> None:
    bench = bench_of(driver, settings(command_timeout=500 * MILLISECOND))
    driver.drives = [None, None, SILENT, None]
    bench.put(50, right=1, left=1)
    bench.run(5000)
    assert [fault.kind for _, fault in bench.said["fault"]] == ["NoAcknowledge", "NotReady"]
    assert driver.driven[-1][0] == STOP
    assert driver.driven[-1][1] <= 50 + 500 + 50


def test_treads_without_a_new_command_are_stopped_after_the_timeout(
    driver: ScriptedDriver,
) -> None:
    bench = bench_of(driver, settings(command_timeout=500 * MILLISECOND))
    bench.play(f"{AHEAD}; 300 right=1; 5000; steps is 0")
    assert bench.driven == " ".join(
        [*(f"{at}:0.5/0.5" for at in (50, 250, 300, 500, 700)), "800:stop"]
    )
    assert [fault.reason for fault in bench.faults] == ["treads: no command for 0.5 s; stopped"]


def test_standing_treads_need_no_commands(driver: ScriptedDriver) -> None:
    bench = bench_of(driver, settings(command_timeout=500 * MILLISECOND))
    bench.put(50, right=0, left=0)
    bench.run(5000)
    assert bench.faults == []


def test_exit_stops_in_whatever_phase(bench: TreadsBench, driver: ScriptedDriver) -> None:
    bench.put(50, right=1, left=1)
    assert bench.simulator.exit() == []
    assert driver.driven[-1][0] == STOP
