import math
import re

import pytest
from firmware_drivers.motors import FAULTS_BEFORE_FORGETTING
from firmware_drivers.treads import TreadSpeeds

from firmware_runtime.devs.time import MILLISECOND
from tests.support.atomic_bench import AtomicBench
from tests.support.scripted_chip import SILENT
from tests.support.scripted_treads import STOP, ScriptedDriver, bench_of, settings


@pytest.fixture
def driver() -> ScriptedDriver:
    return ScriptedDriver()


@pytest.fixture
def bench(driver: ScriptedDriver) -> AtomicBench:
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
    bench: AtomicBench, driver: ScriptedDriver, command: dict[str, object], reason: str
) -> None:
    bench.put(50, right=1, left=1)
    bench.put(60, **command)
    bench.run(1000)
    assert driver.driven[1:] == [(STOP, 60)]
    (fault,) = bench.faults
    assert fault.kind == "NotReady"
    assert re.search(reason, fault.reason)
    assert bench.model.phase == "still"


def test_a_good_command_is_obeyed_after_one_that_was_none(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    bench.put(50, left=3)
    bench.put(60, left=1)
    bench.run(70)
    assert driver.driven == [(STOP, 50), ((0.5, 0.0), 60)]
    assert len(bench.faults) == 1


def test_a_chip_that_did_not_take_the_stop_of_a_bad_command_is_brought_up_again(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    driver.stops = [SILENT, None]
    bench.put(50, left=3)
    bench.run(200)
    assert driver.times(STOP) == [50, 100]
    assert driver.times("step") == [0, 100]


def test_a_write_that_fails_stops_at_once_and_is_repeated_once_the_chip_is_up(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    driver.drives = [None, SILENT, None]
    bench.put(50, right=1, left=1)
    bench.run(300)
    assert driver.driven == [
        ((0.5, 0.5), 50),
        ((0.5, 0.5), 250),
        (STOP, 250),
        ((0.5, 0.5), 260),
    ]
    assert [(at, fault.kind) for at, fault in bench.said["fault"]] == [(250, "NoAcknowledge")]
    assert driver.times("step") == [0, 250]
    assert bench.model.phase == "driving"


def test_a_chip_that_resets_whenever_it_drives_is_given_up(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    """As a supply does that cannot feed the motors: each command is taken once, and then lost."""
    driver.drives = [None, SILENT] * 100
    bench.put(50, right=1, left=1)
    bench.run(20_000)
    consecutive = [fault.consecutive for _, fault in bench.said["fault"]]
    assert consecutive == list(range(1, FAULTS_BEFORE_FORGETTING + 1))
    assert bench.model.phase == "still"
    assert driver.driven[-1][0] == STOP


def test_after_that_a_new_command_is_obeyed(bench: AtomicBench, driver: ScriptedDriver) -> None:
    driver.drives = [*([None, SILENT] * FAULTS_BEFORE_FORGETTING), None]
    bench.put(50, right=1, left=1)
    bench.put(19_000, right=2)
    bench.run(20_000)
    assert bench.model.phase == "driving"
    assert driver.driven[-1][0] == (0.0, -0.5)


def test_two_commands_taken_end_a_row_of_faults(bench: AtomicBench, driver: ScriptedDriver) -> None:
    driver.drives = [None, SILENT, None, None, SILENT, None]
    bench.put(50, right=1, left=1)
    bench.run(2000)
    assert [fault.consecutive for _, fault in bench.said["fault"]] == [1, 1]


def test_a_command_is_not_repeated_beyond_its_timeout(driver: ScriptedDriver) -> None:
    bench = bench_of(driver, settings(command_timeout=500 * MILLISECOND))
    driver.drives = [None, None, SILENT, None]
    bench.put(50, right=1, left=1)
    bench.run(5000)
    assert [fault.kind for _, fault in bench.said["fault"]] == ["NoAcknowledge", "NotReady"]
    assert driver.driven[-1][0] == STOP
    assert driver.driven[-1][1] <= 50 + 500 + 50


def test_a_stop_is_repeated_until_it_is_acknowledged_and_then_the_chip_brought_up(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    driver.drives = [None, SILENT, None]
    driver.stops = [SILENT, SILENT, None]
    bench.put(50, right=1, left=1)
    bench.run(1000)
    assert driver.times(STOP) == [250, 300, 350]
    assert [(at, fault.consecutive) for at, fault in bench.said["fault"]] == [
        (250, 1),
        (250, 2),
        (300, 3),
    ]
    assert driver.times("step") == [0, 350]


def test_a_command_while_the_stop_is_pending_is_obeyed_after_it(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    driver.drives = [None, SILENT, None]
    driver.stops = [SILENT, None]
    bench.put(50, right=1, left=1)
    bench.put(270, right=2)
    bench.run(400)
    assert driver.driven[-2:] == [(STOP, 300), ((0.5, -0.5), 310)]


def test_commands_are_obeyed_again_after_a_fault(
    bench: AtomicBench, driver: ScriptedDriver
) -> None:
    driver.drives = [SILENT, None]
    bench.put(50, right=1, left=1)
    bench.put(100, right=1, left=1)
    bench.run(150)
    assert driver.driven[-1] == ((0.5, 0.5), 100)
    assert len(bench.faults) == 1


def test_treads_without_a_new_command_are_stopped_after_the_timeout(
    driver: ScriptedDriver,
) -> None:
    bench = bench_of(driver, settings(command_timeout=500 * MILLISECOND))
    bench.put(50, right=1, left=1)
    bench.put(300, right=1)
    bench.run(5000)
    assert driver.driven[-1] == (STOP, 800)
    assert [at for call, at in driver.driven if call == (0.5, 0.5)] == [50, 250, 300, 500, 700]
    assert [fault.reason for fault in bench.faults] == ["treads: no command for 0.5 s; stopped"]
    assert driver.times("step") == [0]


def test_standing_treads_need_no_commands(driver: ScriptedDriver) -> None:
    bench = bench_of(driver, settings(command_timeout=500 * MILLISECOND))
    bench.put(50, right=0, left=0)
    bench.run(5000)
    assert bench.faults == []


def test_exit_stops_in_whatever_phase(bench: AtomicBench, driver: ScriptedDriver) -> None:
    bench.put(50, right=1, left=1)
    assert bench.simulator.exit() == []
    assert driver.driven[-1][0] == STOP
