"""The detective robot, whole, on its doubles in virtual time.

Every mission ends: found, or failed with a sentence, and all off.
"""

import math
from itertools import cycle
from pathlib import Path
from typing import Protocol, cast

import pytest
from msgspec.structs import replace

from firmware_runtime import RunState, Strike, open_board
from firmware_runtime.devs.time import SECOND
from sim_doubles.chips.md25 import Md25Double
from sim_doubles.chips.pca9685 import Pca9685Double
from sim_doubles.faults import FaultScript, NackAddress
from sim_doubles.rigs.detective import DetectiveRig
from tests.support.detective_outage import mission_with_outage
from tests.support.second_choice_board import second_choice_board
from tests.support.virtual_detective import (
    LONGEST_S,
    VirtualDetective,
    target_at,
    virtual_detective,
)

pytestmark = pytest.mark.slow

MD25, BODY_SONAR, BODY_COMPASS = 0x58, 0x75, 0x62
PHASES_S = {"search": 3, "turn": 5.6, "approach": 20}
"""An instant in each phase of the default mission."""
NOWHERE = "world.target=[50.0, 50.0]"
NEAR = "world.target=[-0.6, 0.35]"


class Supplied(Protocol):
    """A chip whose supply can fail."""

    def power_cycle(self) -> None: ...


def under_way(
    until_s: float, *assignments: str, board: str | Path = "detective"
) -> VirtualDetective:
    robot = virtual_detective(*assignments, board=board)
    robot.run(until_s)
    return robot


def silence(robot: VirtualDetective, address: int, times: int | None = None) -> None:
    fault = NackAddress(address=address, times=times)
    robot.rig.buses["i2c1"].faults = FaultScript([fault])


def chips_of(robot: VirtualDetective) -> dict[str, Supplied]:
    """Every chip on the bus, with a number where there are two of a kind."""
    wired = robot.rig.buses["i2c1"].targets
    return {
        f"{type(chip).__name__}{number}": cast("Supplied", chip)
        for number, chip in enumerate(wired)
    }


CHIPS = sorted(chips_of(virtual_detective()))


def failed(robot: VirtualDetective) -> tuple[int, str]:
    """When the one mission failed, and why; the treads stand."""
    ((at, ending),) = robot.endings
    assert ending.failed
    assert ending.reason
    assert robot.are_treads_still()
    return at, ending.reason


def ends(robot: VirtualDetective) -> bool:
    """Let the mission go on to its end; return whether it was found. Everything stands then."""
    found = robot.run_mission()["found"]
    ((_, ending),) = robot.endings
    assert ending.failed is not found
    assert ending.reason
    robot.run(robot.simulator.now / SECOND + 3)
    assert robot.are_treads_still()
    return bool(found)


# Found --------------------------------------------------------------------------------------------


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
    """Sabertooth and MaxBotix on serial ports, an HMC5883L for the body's compass.

    A Sabertooth that loses its supply leaves no mission without an end.
    """
    board = second_choice_board(tmp_path)
    result = virtual_detective(board=board).run_mission()
    assert result["found"] is True
    assert 0.05 < result["stopped_m"] < 0.5
    driving = under_way(PHASES_S["approach"], board=board)
    assert driving.rig.outputs["treads"] == 2
    robot = under_way(3, "mission.longest_s=60", board=board)
    robot.rig.ports["treads"]._target.power_cycle()  # type: ignore[attr-defined]
    ends(robot)


def test_an_upright_compass_with_headings_counted_the_other_way_serves_too() -> None:
    upright = ("radar_compass.counterclockwise=true", "body_compass.counterclockwise=true")
    robot = virtual_detective("world.compass_mounting=upright", *upright)
    assert robot.run_mission()["found"] is True


def test_the_same_seed_ends_at_the_same_place_and_one_fault_alone_ends_no_mission() -> None:
    first, again = (virtual_detective(NEAR, "world.seed=5").run_mission() for _ in range(2))
    assert first == again
    robot = under_way(3, NEAR)
    silence(robot, BODY_SONAR, times=1)
    assert robot.run_mission()["found"] is True
    assert len(robot.faults) == 1


# A chip is silent ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("address", "silent_after_s"),
    [(0x73, 0.5), (BODY_SONAR, 0.5), (BODY_COMPASS, 0.3), (0x61, 0.6)],
)
def test_an_unplugged_sensor_stops_the_treads_in_time(address: int, silent_after_s: float) -> None:
    robot = under_way(3)
    assert not robot.are_treads_still()
    silence(robot, address)
    robot.run(3 + silent_after_s)
    at, reason = failed(robot)
    assert f"0x{address:02x}" in reason
    assert at <= (3 + silent_after_s) * SECOND
    assert robot.faults[-1][1].kind == "NoAcknowledge"


@pytest.mark.parametrize("phase", PHASES_S)
@pytest.mark.parametrize("address", [0x40, MD25, 0x61, BODY_COMPASS, 0x73, BODY_SONAR])
def test_a_chip_that_answers_no_more(address: int, phase: str) -> None:
    robot = under_way(PHASES_S[phase], "mission.longest_s=40")
    silence(robot, address)
    if (address, phase) == (MD25, "search"):  # its own timeout stops the treads
        robot.run(5.1)
        assert "0x58" in failed(robot)[1]
    ends(robot)


def test_a_compass_that_hangs_is_found_out_while_the_robot_turns() -> None:
    robot = virtual_detective("world.body_compass_stuck_s=5", "turn_check.still_turn_deg=60")
    robot.run_mission()
    robot.run(7.5)
    at, reason = failed(robot)
    assert "readings in a row, expected some noise" in reason
    assert 6 * SECOND < at < 7.2 * SECOND


@pytest.mark.parametrize("stuck_s", [5.0, 6.0, 7.3, 7.8])
def test_a_compass_that_hangs_is_contradicted_by_the_turn_before_it_shows(stuck_s: float) -> None:
    turns_s = 5.4
    robot = virtual_detective(f"world.body_compass_stuck_s={stuck_s}")
    robot.run_mission()
    robot.run(10)
    at, reason = failed(robot)
    assert "turn_check: turn (degrees, compass less treads' command)" in reason
    assert 0.4 < at / SECOND - max(stuck_s, turns_s) < 0.7


@pytest.mark.parametrize(
    ("at_s", "after_s"),
    [
        pytest.param(5.0, (0.4, 0.7), id="in the first sweep"),
        pytest.param(8.5, (0.4, 0.7), id="in the next one"),
        pytest.param(8.0, (1.4, 1.8), id="where it may be at a stop"),
    ],
)
def test_a_head_that_its_motor_does_not_turn_ends_the_mission(
    at_s: float, after_s: tuple[float, float]
) -> None:
    dead = Strike("dead", "radar_motor", at_s=at_s, amount=0.0)
    far = {"world.target": [6.0, 6.0]}
    with open_board("detective", doubles=True, clock="virtual", set=far, faults=[dead]) as robot:
        ended = robot.run(10.0)
        assert (
            "head_check: turn of the head (degrees, compass less motor's command)" in ended.reason
        )
        assert after_s[0] < ended.at / SECOND - at_s < after_s[1]


@pytest.mark.parametrize("head_start_deg", [-190.0, -100.0, 0.0])
def test_a_head_that_begins_at_its_other_end_or_anywhere_ends_no_mission(
    head_start_deg: float,
) -> None:
    begins = {"world.head_start_deg": head_start_deg}
    with open_board("detective", doubles=True, clock="virtual", set=begins) as robot:
        assert robot.run(15.0).state is RunState.ENDED


@pytest.mark.parametrize("at_s", [1.0, 5.3, 6.0, 7.9])
@pytest.mark.parametrize("tread", [0.0, 1.0])
def test_a_tread_that_turns_and_was_not_told_to_ends_the_mission(at_s: float, tread: float) -> None:
    runs = Strike("full-on", "treads", at_s=at_s, for_s=1.0, amount=tread)
    with open_board("detective", doubles=True, clock="virtual", faults=[runs]) as robot:
        ended = robot.run(10.0)
        assert "turn" in ended.reason  # its encoder says so, or the compass in a turn
        assert ended.at / SECOND - at_s < 0.7


@pytest.mark.parametrize(
    "turns_it",
    [Strike("push", at_s=9.0, amount=0.15), Strike("dead", "treads", 15.01, 1.0, amount=0.0)],
)
def test_what_turns_it_on_the_way_to_a_target_not_looked_for_again_ends_the_mission(
    turns_it: Strike,
) -> None:
    with open_board("detective", doubles=True, clock="virtual", faults=[turns_it]) as robot:
        ended = robot.run(45.0)
        assert "course_check: turn from its course" in ended.reason
        assert ended.at / SECOND - turns_it.at_s < 1.2


def test_a_small_push_on_the_way_is_borne() -> None:
    push = Strike("push", at_s=13.0, amount=-0.1)
    with open_board("detective", doubles=True, clock="virtual", faults=[push]) as robot:
        assert robot.run(45.0).reason == "the target was reached"


def test_a_tread_that_turns_while_it_stands_is_a_runaway() -> None:
    runs = Strike("full-on", "treads", at_s=1.0, for_s=1.0, amount=0.0)
    with open_board("detective", doubles=True, clock="virtual", faults=[runs]) as robot:
        assert robot.run(10.0).state is RunState.FAILED
        assert list(robot.statistics.faults["treads"]) == ["Runaway"]


@pytest.mark.parametrize("for_s", [1.0, None])
@pytest.mark.parametrize("strike", [Strike("flip", amount=23.0), Strike("wrong-byte", amount=3.0)])
def test_an_echo_of_nothing_is_reported_with_the_next_ping_and_turns_it_no_further(
    strike: Strike, for_s: float | None
) -> None:
    struck = replace(strike, device="radar_sonar", at_s=2.42, for_s=for_s)
    with open_board("detective", doubles=True, clock="virtual", faults=[struck]) as robot:
        robot.run(4.4)
        assert isinstance(robot.rig, DetectiveRig)
        heading_rad = robot.rig.arena.pose(robot.rig.now()).heading_rad
        assert heading_rad == pytest.approx(math.pi / 2, abs=0.1)
        found = robot.statistics.faults["radar_sonar"]
        assert list(found) == ["Stuck"]
        assert (found["Stuck"].first_s or 0.0) < 2.42 + 0.1
        assert robot.rig.outputs["treads"] == 0


@pytest.mark.parametrize("at_s", [1.827145, 3.807145])
def test_one_echo_of_nothing_that_the_next_two_pings_do_not_hear_ends_the_mission(
    at_s: float,
) -> None:
    struck = Strike("wrong-byte", "radar_sonar", at_s=at_s, for_s=0.0, amount=3.0)
    with open_board("detective", doubles=True, clock="virtual", faults=[struck]) as robot:
        ended = robot.run(10.0)
        assert "second_look: what stopped the head (m) is 2.55, expected heard" in ended.reason
        assert ended.at / SECOND - at_s < 0.15


def test_one_echo_of_nothing_before_it_is_no_target_that_was_reached() -> None:
    struck = Strike("flip", "body_sonar", at_s=20.0, for_s=0.0, amount=26.0)  # 32 cm
    with open_board("detective", doubles=True, clock="virtual", faults=[struck]) as robot:
        robot.run(22.0)
        assert robot.rig is not None
        assert robot.rig.outputs["treads"] == 2


def test_after_a_failure_no_command_reaches_a_motor() -> None:
    robot = under_way(1)
    silence(robot, BODY_SONAR)
    robot.run(20)
    assert robot.are_treads_still()
    assert robot.rig.outputs == {"radar_motor": 3, "treads": 0}
    assert robot.robot.make_safe() == []
    assert robot.rig.outputs == {"radar_motor": 0, "treads": 0}


def test_a_mission_without_a_target_ends_in_time() -> None:
    robot = under_way(30, NOWHERE, "mission.longest_s=20")
    at, reason = failed(robot)
    assert "20 s" in reason
    assert 20 * SECOND <= at <= 22 * SECOND


@pytest.mark.parametrize("bit", [2056, 2061, 2062, 2063])
def test_treads_stop_whichever_bit_of_their_mode_is_read_wrongly_meanwhile(bit: int) -> None:
    flipped = Strike("flip", "treads", at_s=8.01, for_s=1.0, amount=float(bit))
    with open_board("detective", doubles=True, clock="virtual", faults=[flipped]) as robot:
        assert robot.run(10.0).state is RunState.FAILED
        assert robot.outputs == {"radar_motor": 0, "treads": 0}


# A supply fails -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "phase"),
    [
        *(("Md25Double1", phase) for phase in PHASES_S),
        *(pair for pair in zip(CHIPS, cycle(PHASES_S), strict=False) if pair[0] != "Md25Double1"),
    ],
)
def test_a_chip_that_loses_its_supply_for_a_moment(name: str, phase: str) -> None:
    robot = under_way(PHASES_S[phase])
    chips_of(robot)[name].power_cycle()
    assert ends(robot)


@pytest.mark.parametrize("phase", ["search", "approach"])
def test_all_chips_lose_their_supply_for_a_moment(phase: str) -> None:
    robot = under_way(PHASES_S[phase])
    robot.rig.buses["i2c1"].power_cycle()
    ends(robot)


@pytest.mark.parametrize("begins_s", [3.0, 3.2, 3.4])
def test_an_md25_that_loses_its_supply_is_driven_on(begins_s: float) -> None:
    robot = under_way(begins_s)
    chips_of(robot)["Md25Double1"].power_cycle()
    robot.run(begins_s + 1.0)
    assert not robot.are_treads_still()
    assert [fault.consecutive for _, fault in robot.faults] == [1]


@pytest.mark.parametrize(("kind", "within_s"), [(Md25Double, 5), (Pca9685Double, 60)])
def test_a_chip_that_loses_its_supply_again_and_again_fails_the_mission(
    kind: type[Md25Double | Pca9685Double], within_s: float
) -> None:
    """As one does whose motors take too much; every bring-up works, and is for nothing."""
    robot = virtual_detective(NOWHERE)
    (chip,) = (chip for chip in chips_of(robot).values() if isinstance(chip, kind))
    at_s = 3.0
    while not robot.endings and at_s < LONGEST_S:
        robot.run(at_s)
        chip.power_cycle()
        at_s += 0.1
    ((at, ending),) = robot.endings
    assert ending.failed
    assert at < (3 + within_s) * SECOND


@pytest.mark.parametrize(
    ("begins_s", "lasts_s"), [(0.2, 0.3), (3.3, 0.3), (5.6, 0.9), (20.0, 0.3), (34.41, 0.3)]
)
def test_a_bus_outage_leaves_nothing_on(begins_s: float, lasts_s: float) -> None:
    mission = mission_with_outage(begins_s, lasts_s)
    assert mission.is_safe
    assert mission.ending is not None


def test_a_bus_that_stays_away_is_given_up_with_a_sentence() -> None:
    mission = mission_with_outage(3.0, 100.0)
    assert mission.outputs_on > 0
    assert any("i2c1" in fault for fault in mission.outcome.faults)
    assert "given up" in mission.outcome.faults[-1]
