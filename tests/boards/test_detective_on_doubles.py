"""The detective robot, whole, on its doubles in virtual time."""

from pathlib import Path

import pytest

from firmware_runtime.devs.time import SECOND
from sim_doubles.faults import FaultScript, NackAddress
from tests.support.second_choice_board import second_choice_board
from tests.support.virtual_detective import target_at, virtual_detective

pytestmark = pytest.mark.slow

MD25, RADAR_SONAR, BODY_SONAR, BODY_COMPASS = 0x58, 0x73, 0x75, 0x62


@pytest.mark.parametrize(
    ("bearing_deg", "distance_m"),
    [(0, 1), (0, 4), (90, 2), (135, 4), (180, 1), (225, 2), (315, 2)],
)
def test_it_finds_its_target_and_stops_in_front_of_it(bearing_deg: int, distance_m: int) -> None:
    robot = virtual_detective(target_at(bearing_deg, distance_m), f"world.seed={bearing_deg}")
    result = robot.run_mission()
    assert result["found"] is True
    assert 0.05 < result["stopped_m"] < 0.5
    assert not robot.rig.arena.collided


def test_with_the_second_choice_of_every_chip_it_finds_its_target_too(tmp_path: Path) -> None:
    """Sabertooth and MaxBotix on serial ports, an HMC5883L for the body's compass."""
    result = virtual_detective(board=second_choice_board(tmp_path)).run_mission()
    assert result["found"] is True
    assert 0.05 < result["stopped_m"] < 0.5


def test_an_upright_compass_with_headings_counted_the_other_way_serves_too() -> None:
    robot = virtual_detective(
        "world.compass_mounting=upright",
        "radar_compass.counterclockwise=true",
        "body_compass.counterclockwise=true",
    )
    assert robot.run_mission()["found"] is True


def test_the_same_seed_ends_at_the_same_place() -> None:
    results = [virtual_detective("world.seed=5").run_mission() for _ in range(2)]
    assert results[0] == results[1]


@pytest.mark.parametrize(
    ("address", "silent_after_s", "kind"),
    [
        (RADAR_SONAR, 0.5, "NoAcknowledge"),
        (BODY_SONAR, 0.5, "NoAcknowledge"),
        (BODY_COMPASS, 0.3, "NoAcknowledge"),
        (0x61, 0.6, "NoAcknowledge"),
    ],
)
def test_an_unplugged_sensor_stops_the_treads_in_time(
    address: int, silent_after_s: float, kind: str
) -> None:
    robot = virtual_detective()
    robot.run(3)
    assert not robot.are_treads_still()
    robot.rig.buses["i2c1"].faults = FaultScript([NackAddress(address=address, times=None)])
    robot.run(3 + silent_after_s)
    assert robot.are_treads_still()
    ((at, ending),) = robot.endings
    assert ending.failed
    assert f"0x{address:02x}" in ending.reason
    assert at <= (3 + silent_after_s) * SECOND
    assert robot.faults[-1][1].kind == kind


def test_a_compass_that_hangs_is_found_out_while_the_robot_turns() -> None:
    robot = virtual_detective("world.body_compass_stuck_s=5")
    robot.run_mission()
    ((at, ending),) = robot.endings
    assert ending.failed
    assert "readings in a row, expected some noise" in ending.reason
    assert 6 * SECOND < at < 7.2 * SECOND
    robot.run(7.5)
    assert robot.are_treads_still()


def test_a_silent_md25_ends_the_mission_and_its_own_timeout_stops_the_treads() -> None:
    robot = virtual_detective()
    robot.run(3)
    robot.rig.buses["i2c1"].faults = FaultScript([NackAddress(address=MD25, times=None)])
    robot.run(5.1)
    assert robot.are_treads_still()
    ((_at, ending),) = robot.endings
    assert ending.failed
    assert "0x58" in ending.reason


def test_after_a_failure_no_command_reaches_a_motor() -> None:
    robot = virtual_detective()
    robot.run(1)
    robot.rig.buses["i2c1"].faults = FaultScript([NackAddress(address=BODY_SONAR, times=None)])
    robot.run(20)
    assert robot.are_treads_still()
    assert robot.rig.outputs == {"radar_motor": 3, "treads": 0}
    assert robot.robot.make_safe() == []
    assert robot.rig.outputs == {"radar_motor": 0, "treads": 0}


def test_one_fault_alone_does_not_end_the_mission() -> None:
    robot = virtual_detective()
    robot.run(3)
    robot.rig.buses["i2c1"].faults = FaultScript([NackAddress(address=BODY_SONAR, times=1)])
    assert robot.run_mission()["found"] is True
    assert len(robot.faults) == 1
