"""Treads on a scripted driver: commands, refreshes, stops and what follows."""

import math
import re

import pytest
from firmware_drivers.chips.md25 import Md25, Md25Report, Md25Settings
from firmware_drivers.motors import FAULTS_BEFORE_FORGETTING
from firmware_drivers.tables.treads import Md25Table
from firmware_drivers.treads import Treads, TreadSettings, TreadSpeeds

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.errors import SettingError
from firmware_runtime.models.motion import Applied
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.faults import AbsentTarget, FaultScript
from tests.support.scripted_chip import SILENT
from tests.support.scripted_treads import STOP, ScriptedDriver, TreadsBench, bench_of, settings
from tests.support.virtual_bus import VirtualBus
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
    assert settings(refresh=500 * MILLISECOND).faults(driver.timeout_ns) == ()


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


def test_treads_that_stand_apply_all_of_it_after_speeds_that_were_too_high(
    driver: ScriptedDriver,
) -> None:
    stated = settings(full_counts_s=100_000.0, command_timeout=500 * MILLISECOND)
    bench = bench_of(driver, stated)
    driver.drives = [REPORT]
    bench.put(50, speeds=TreadSpeeds(1.5, 0.5))
    bench.run(3000)
    assert bench.said["applied"][-2:] == [(550, Applied.NOTHING), (750, Applied.ALL)]


def test_standing_treads_need_no_commands(driver: ScriptedDriver) -> None:
    bench = bench_of(driver, settings(command_timeout=500 * MILLISECOND))
    bench.put(50, right=0, left=0)
    bench.run(5000)
    assert bench.faults == []


def test_standing_treads_with_encoders_are_looked_after_and_may_not_turn(
    driver: ScriptedDriver,
) -> None:
    bench = bench_of(driver, settings(full_counts_s=1000.0))
    driver.drives = [*([REPORT] * 3), REPORT._replace(left_encoder=900)]
    bench.run(640)
    assert bench.driven == "210:0/0 410:0/0 610:0/0"
    assert bench.said["applied"] == [(0, Applied.NOTHING), (210, Applied.ALL)]
    bench.run(840)
    assert [fault.kind for fault in bench.faults] == ["Runaway"]
    assert bench.driven.endswith(" 810:stop 820:0/0")


@pytest.mark.parametrize(
    ("count", "wrong"), [(0, 8), (0, 2**30), (0, -(2**31)), (-1, -9), (-1, -1 - 2**30)]
)
def test_an_encoder_that_once_reads_with_a_wrong_bit_is_read_again(
    driver: ScriptedDriver, count: int, wrong: int
) -> None:
    bench = bench_of(driver, settings(full_counts_s=1000.0))
    right, leap = REPORT._replace(right_encoder=count), REPORT._replace(right_encoder=wrong)
    driver.drives = [right, leap, right]
    bench.run(640)
    assert (bench.driven, bench.faults) == ("210:0/0 410:0/0 410:0/0 610:0/0", [])


def test_a_tread_that_is_pushed_while_outputs_are_disabled_has_not_turned_unasked(
    driver: ScriptedDriver,
) -> None:
    bench = bench_of(driver, settings(full_counts_s=1000.0))
    driver.drives = [REPORT._replace(right_encoder=5000), *([REPORT] * 2)]
    enabled = True
    assert isinstance(bench.model, Treads)
    bench.model.interlock = lambda: enabled
    bench.run(240)
    enabled = False
    bench.run(440)
    enabled = True
    bench.run(900)
    assert (bench.driven, bench.faults) == ("210:0/0 610:0/0 810:0/0", [])


def test_exit_stops_in_whatever_phase(bench: TreadsBench, driver: ScriptedDriver) -> None:
    bench.put(50, right=1, left=1)
    assert bench.simulator.exit() == []
    assert driver.driven[-1][0] == STOP


@pytest.mark.parametrize("mounted", [(), ("left",), ("right",)])
def test_a_table_reverses_the_motors_that_it_says_and_knows_the_ramp(
    mounted: tuple[str, ...],
) -> None:
    stated = {f"{side}_reversed": True for side in mounted}
    table = Md25Table(speed=0.5, refresh_s=0.2, bus="i2c1", address=0x58, **stated)
    found = table.model
    assert (found.left_reversed, found.right_reversed) == ("left" in mounted, "right" in mounted)
    assert found.ramp == pytest.approx(635 * MILLISECOND)  # 127 steps, 5 each 25 ms


# On a double --------------------------------------------------------------------------------------


@pytest.mark.parametrize("every_ms", [20, 50, 100, 500])
@pytest.mark.parametrize("speed", [0.3, 1.0])
def test_commands_that_come_faster_than_a_ramp_ends_are_no_fault(
    every_ms: int, speed: float
) -> None:
    rig = VirtualBus()
    rig.connect(Md25Double, full_speed_rad_s=17.8)
    driver = Md25(rig.bus, settings=Md25Settings(acceleration=10))
    stated = settings(refresh=SECOND // 2, full_counts_s=1020.0, ramp=325 * MILLISECOND)
    treads = Treads("treads", driver, stated)
    faults = rig.simulate([treads], treads.fault_out)
    speeds = [speed, speed, -speed, speed, 0.0, 0.0]
    for at in range(500, 3500, every_ms):
        rig.run(at * MILLISECOND)
        share = speeds[(at - 500) // 500]
        rig.send(treads.speeds, TreadSpeeds(share, -share), at * MILLISECOND)
    assert faults == []


@pytest.mark.slow
def test_a_silent_md25_is_reported_within_a_refresh_and_stopped_by_its_own_timeout() -> None:
    rig = VirtualBus()
    double = rig.connect(Md25Double, full_speed_rad_s=10.0)
    gone = AbsentTarget(target=double, since=5 * SECOND, until=8 * SECOND)
    rig.doubles.faults = FaultScript([gone])
    treads = Treads("treads", Md25(rig.bus), TreadSettings(speed=0.5, refresh=100 * MILLISECOND))
    faults = rig.simulate([treads], treads.fault_out)

    def drive(at: int) -> None:
        rig.run(at)
        for side in (treads.right, treads.left):
            rig.send(side, 1, at)

    drive(500 * MILLISECOND)
    rig.run(6890 * MILLISECOND)
    assert faults[0][0] == pytest.approx(5 * SECOND, abs=100 * MILLISECOND)
    assert double.speeds_rad_s != (0.0, 0.0)
    rig.run(6950 * MILLISECOND)
    assert double.speeds_rad_s == (0.0, 0.0)
    rig.run(9 * SECOND)
    assert treads.phase == "still"
    drive(9 * SECOND)
    rig.run(10 * SECOND)
    assert double.speeds_rad_s == pytest.approx((5.0, 5.0), abs=0.05)
