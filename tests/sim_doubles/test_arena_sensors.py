"""What the sensors in the arena get: the head's angle, bearings and their sense, echoes."""

import math
from itertools import pairwise

import pytest
from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND, SECOND
from sim_doubles.worlds.arena import ArenaParameters, CompassMounting, bridge_drive
from tests.support.arena_rig import M_PER_UNIT_S, ArenaRig

QUIET = ArenaParameters(target=(50.0, 50.0), compass_noise_deg=0.0)

# The head


@pytest.mark.parametrize(
    ("placed", "drives", "angles_deg"),
    [
        pytest.param(
            QUIET,
            [(0, 1.0)],
            {0: 0.0, 0.5: -30.0, 1: -60.0, 1.5: -90.0, 2: -90.0},
            id="a positive drive turns it clockwise up to its end stop",
        ),
        pytest.param(
            QUIET,
            [(0, 1.0), (3, -1.0)],
            {5.999: 89.94, 6: 90.0},
            id="half a sweep takes three seconds",
        ),
        pytest.param(
            replace(QUIET, head_limit_deg=180.0, head_start_deg=100.0),
            [(1, 0.25), (3, 0.0)],
            {9: 70.0},
            id="less voltage turns it slower and none holds it",
        ),
    ],
)
def test_the_head_turns(
    placed: ArenaParameters, drives: list[tuple[int, float]], angles_deg: dict[float, float]
) -> None:
    rig = ArenaRig(placed)
    for at_s, share in drives:
        rig.turn_head(at_s * SECOND, share)
    for seen_at_s, angle_deg in angles_deg.items():
        found = math.degrees(rig.arena.head_angle_rad(round(seen_at_s * SECOND)))
        assert found == pytest.approx(angle_deg)


@pytest.mark.parametrize("share", [1.01, -2.0, math.nan])
def test_a_drive_beyond_full_voltage_is_refused(share: float) -> None:
    rig = ArenaRig(QUIET)
    rig.share = share
    with pytest.raises(ValueError, match=r"the head's drive is .*, expected -1 to 1"):
        rig.arena.head_angle_rad(SECOND)


@pytest.mark.parametrize(
    ("pwm", "in1", "in2", "drive"),
    [
        (0.5, 1, 0, 0.5),
        (0.5, 0, 1, -0.5),
        (1, 1, 1, 0),
        (1, 0, 0, 0),
        (0, 1, 0, 0),
        (1, 1, 0.25, 0.75),
    ],
    ids=["forward", "reverse", "brake", "coast", "off", "slow decay"],
)
def test_a_bridge_drives_with_the_difference_of_its_inputs(
    pwm: float, in1: float, in2: float, drive: float
) -> None:
    assert bridge_drive(pwm, in1, in2) == drive


# Compasses


@pytest.mark.parametrize(
    ("mounting", "bearings"),
    [("upright", [0.0, 90.0, 200.0]), ("inverted", [0.0, 270.0, 160.0])],
)
def test_upright_shows_bearings_clockwise_from_north_and_inverted_anticlockwise(
    mounting: CompassMounting, bearings: list[float]
) -> None:
    parameters = replace(QUIET, compass_mounting=mounting)
    shown = [
        ArenaRig(replace(parameters, start_bearing_deg=bearing)).arena.body_bearing_deg(0)
        for bearing in (0.0, 90.0, 200.0)
    ]
    assert shown == pytest.approx(bearings)


def test_as_in_figure_6_angles_grow_when_the_right_tread_is_on_1_and_the_left_on_2() -> None:
    rig = ArenaRig(replace(QUIET, start_bearing_deg=-50.0))
    rig.drive(0, 10, -10)
    readings = [rig.arena.body_bearing_deg(at) for at in range(0, 2 * SECOND, SECOND // 5)]
    assert readings[0] == pytest.approx(50.0)
    assert all(earlier < later for earlier, later in pairwise(readings))


def test_the_radar_compass_turns_with_head_and_body() -> None:
    rig = ArenaRig(replace(QUIET, start_bearing_deg=-20.0))
    rig.turn_head(0, -0.5)
    assert rig.arena.radar_bearing_deg(SECOND) == pytest.approx(50.0)
    rig.turn_head(SECOND, 0.0)
    rig.drive(SECOND, 10, -10)
    turned = math.degrees(2 * 10 * M_PER_UNIT_S / 0.25)
    assert rig.arena.body_bearing_deg(2 * SECOND) == pytest.approx(20.0 + turned)
    assert rig.arena.radar_bearing_deg(2 * SECOND) == pytest.approx(50.0 + turned)


def test_noise_belongs_to_compass_seed_and_instant() -> None:
    arena = ArenaRig(replace(QUIET, compass_noise_deg=0.5)).arena
    again = ArenaRig(replace(QUIET, compass_noise_deg=0.5)).arena
    other = ArenaRig(replace(QUIET, compass_noise_deg=0.5, seed=2)).arena
    instants = range(0, 4 * SECOND, MILLISECOND)
    body = [(arena.body_bearing_deg(at) + 180.0) % 360.0 - 180.0 for at in instants]
    deviation = math.sqrt(sum(value * value for value in body) / len(body))
    assert deviation == pytest.approx(0.5, rel=0.05)
    assert abs(sum(body) / len(body)) < 5 * 0.5 / math.sqrt(len(body))
    assert again.body_bearing_deg(SECOND) == arena.body_bearing_deg(SECOND)
    assert arena.radar_bearing_deg(SECOND) != arena.body_bearing_deg(SECOND)
    assert other.body_bearing_deg(SECOND) != arena.body_bearing_deg(SECOND)


def test_an_offset_is_added_to_what_a_compass_shows() -> None:
    arena = ArenaRig(replace(QUIET, body_compass_offset_deg=7.5)).arena
    assert arena.body_bearing_deg(0) == pytest.approx(7.5)
    assert arena.radar_bearing_deg(0) == pytest.approx(0.0)


# Sonars


def test_the_radar_receives_the_target_s_echo_when_the_head_points_at_it() -> None:
    rig = ArenaRig(replace(QUIET, target=(1.5, 0.0)))
    assert rig.arena.radar_echoes(0) == []
    rig.turn_head(0, 1.0)
    at_90_deg = round(1.5 * SECOND)
    assert rig.arena.radar_echoes(at_90_deg) == [pytest.approx(1.4)]
    assert rig.arena.body_echoes(at_90_deg) == []


def test_the_body_sonar_sits_on_the_front() -> None:
    rig = ArenaRig(replace(QUIET, target=(0.0, 1.0)))
    assert rig.arena.body_echoes(0) == [pytest.approx(1.0 - 0.10 - 0.15)]
    assert rig.arena.distance_to_target(0) == pytest.approx(0.75)
    rig.drive(0, 10, 10)
    assert rig.arena.body_echoes(SECOND) == [pytest.approx(0.75 - 10 * M_PER_UNIT_S)]


def test_echoes_come_from_everything_in_the_beam_nearest_first() -> None:
    parameters = replace(
        QUIET,
        target=(0.0, 3.0),
        obstacles=((0.1, 1.5, 0.2), (-3.0, 0.0, 0.5)),
        walls=((-5.0, 4.0, 5.0, 4.0),),
    )
    echoes = ArenaRig(parameters).arena.radar_echoes(0)
    nearest = math.hypot(0.1, 1.5) - 0.2
    assert echoes == pytest.approx([nearest, 2.9, 4.0], abs=0.01)


def test_echoes_from_too_near_or_too_far_are_not_received() -> None:
    parameters = replace(QUIET, target=(0.0, 5.0), sonar_nearest_m=0.3, sonar_farthest_m=4.5)
    near = replace(parameters, obstacles=((0.0, 0.5, 0.1),))
    assert ArenaRig(near).arena.body_echoes(0) == []
    assert ArenaRig(parameters).arena.radar_echoes(0) == []
    assert ArenaRig(replace(parameters, sonar_farthest_m=4.95)).arena.radar_echoes(0) == [4.9]


def test_the_distance_to_the_target_is_from_the_front_wherever_that_points() -> None:
    rig = ArenaRig(replace(QUIET, target=(1.0, 0.0)))
    assert rig.arena.distance_to_target(0) == pytest.approx(math.hypot(1.0, 0.15) - 0.10)


def test_the_radar_looks_over_what_is_low_and_the_body_does_not() -> None:
    north = ArenaParameters(target=(0.0, 3.0), low_walls=((-1.0, 1.0, 1.0, 1.0),))
    rig = ArenaRig(replace(north, low_obstacles=((0.0, 2.0, 0.1),)))
    assert rig.arena.radar_echoes(0) == [pytest.approx(2.9)]
    assert rig.arena.body_echoes(0)[0] == pytest.approx(0.85)
