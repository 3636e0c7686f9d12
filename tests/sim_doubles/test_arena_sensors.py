"""What sensors in the arena get, where beams meet circles and walls, and refused parameters."""

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from msgspec.structs import replace

from firmware_runtime.devs.time import MILLISECOND, SECOND
from sim_doubles.worlds.arena import ArenaParameters, CompassMounting, bridge_drive
from sim_doubles.worlds.arena_geometry import Beam, Circle, Wall
from sim_doubles.worlds.arena_probe import ArenaProbe
from tests.support.arena_rig import M_PER_UNIT_S, ArenaRig
from tests.support.atomic_bench import AtomicBench

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


def test_sonars_sit_on_head_and_front_and_distance_is_from_the_front() -> None:
    rig = ArenaRig(replace(QUIET, target=(1.5, 0.0)))
    assert rig.arena.radar_echoes(0) == []
    rig.turn_head(0, 1.0)
    at_90_deg = round(1.5 * SECOND)
    assert rig.arena.radar_echoes(at_90_deg) == [pytest.approx(1.4)]
    assert rig.arena.body_echoes(at_90_deg) == []
    rig = ArenaRig(replace(QUIET, target=(0.0, 1.0)))
    assert rig.arena.body_echoes(0) == [pytest.approx(1.0 - 0.10 - 0.15)]
    assert rig.arena.distance_to_target(0) == pytest.approx(0.75)
    rig.drive(0, 10, 10)
    assert rig.arena.body_echoes(SECOND) == [pytest.approx(0.75 - 10 * M_PER_UNIT_S)]
    rig = ArenaRig(replace(QUIET, target=(1.0, 0.0)))
    assert rig.arena.distance_to_target(0) == pytest.approx(math.hypot(1.0, 0.15) - 0.10)


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


def test_echoes_are_of_what_is_neither_too_near_nor_too_far_nor_looked_over() -> None:
    parameters = replace(QUIET, target=(0.0, 5.0), sonar_nearest_m=0.3, sonar_farthest_m=4.5)
    near = replace(parameters, obstacles=((0.0, 0.5, 0.1),))
    assert ArenaRig(near).arena.body_echoes(0) == []
    assert ArenaRig(parameters).arena.radar_echoes(0) == []
    assert ArenaRig(replace(parameters, sonar_farthest_m=4.95)).arena.radar_echoes(0) == [4.9]
    north = ArenaParameters(target=(0.0, 3.0), low_walls=((-1.0, 1.0, 1.0, 1.0),))
    rig = ArenaRig(replace(north, low_obstacles=((0.0, 2.0, 0.1),)))
    assert rig.arena.radar_echoes(0) == [pytest.approx(2.9)]
    assert rig.arena.body_echoes(0)[0] == pytest.approx(0.85)


EAST = 0.0
TEN_DEG = math.radians(10.0)
AHEAD = Beam(0.0, 0.0, EAST, TEN_DEG)
RAYS = 501

places = st.floats(-4.0, 4.0)
beams = st.builds(
    Beam,
    places,
    places,
    st.floats(-math.pi, math.pi),
    st.floats(math.radians(0.1), math.radians(80)),
)


def test_a_circle_beside_the_beam_is_met_where_the_edge_cuts_it() -> None:
    aside = 2.0 * math.tan(TEN_DEG)  # where the beam's left edge is
    grazed = Circle(2.0, aside + 0.05, 0.1).echo(AHEAD)
    x, y = grazed * math.cos(TEN_DEG), grazed * math.sin(TEN_DEG)
    assert math.hypot(x - 2.0, y - aside - 0.05) == pytest.approx(0.1)
    assert Circle(2.0, aside + 0.12, 0.1).echo(AHEAD) == math.inf
    assert Circle(2.0, -aside - 0.05, 0.1).echo(AHEAD) == pytest.approx(grazed)


def test_nothing_behind_echoes_and_a_sonar_inside_a_circle_receives_at_once() -> None:
    assert Circle(-1.0, 0.0, 0.5).echo(AHEAD) == math.inf
    assert Wall(-1.0, -3.0, -1.0, 3.0).echo(AHEAD) == math.inf
    assert Circle(0.0, 0.2, 0.3).echo(AHEAD) == 0.0


def test_a_wall_is_met_at_the_edge_of_the_beam_and_is_as_far_as_its_nearest_part() -> None:
    assert Wall(-3.0, 0.5, 9.0, 0.5).echo(AHEAD) == pytest.approx(0.5 / math.sin(TEN_DEG))
    assert Wall(-3.0, -0.5, 9.0, -0.5).echo(AHEAD) == pytest.approx(0.5 / math.sin(TEN_DEG))
    wall = Wall(0.0, 0.0, 4.0, 0.0)
    assert wall.distance(1.0, -2.0) == pytest.approx(2.0)
    assert wall.distance(7.0, 4.0) == pytest.approx(5.0)
    assert Circle(0.0, 0.0, 0.5).distance(3.0, 4.0) == pytest.approx(4.5)


@given(beams, places, places, st.floats(0.05, 1.0))
def test_a_circle_is_met_as_a_fan_of_rays_meets_it(
    beam: Beam, x: float, y: float, radius: float
) -> None:
    assume(math.hypot(x - beam.x_m, y - beam.y_m) > radius + 0.01)
    check_against_rays(beam, Circle(x, y, radius).echo(beam), ray_to_circle(beam, x, y, radius))


@given(beams, places, places, places, places)
def test_a_wall_is_met_as_a_fan_of_rays_meets_it(
    beam: Beam, x1: float, y1: float, x2: float, y2: float
) -> None:
    assume(math.hypot(x2 - x1, y2 - y1) > 0.05)
    assume(Wall(x1, y1, x2, y2).distance(beam.x_m, beam.y_m) > 0.01)
    check_against_rays(beam, Wall(x1, y1, x2, y2).echo(beam), ray_to_wall(beam, x1, y1, x2, y2))


def check_against_rays(beam: Beam, echo: float, ray: Callable[[float], float]) -> None:
    """The nearest ray is no nearer than the echo, and hardly farther when the fan is fine."""
    half = beam.half_angle_rad * (1.0 - 1e-6)  # what ends right on the edge may be met or not
    step = 2.0 * half / (RAYS - 1)
    met = [ray(-half + n * step) for n in range(RAYS)]
    assert min(met) >= echo - 1e-9
    several = sum(distance < math.inf for distance in met) > RAYS // 20
    if several:
        assert min(met) == pytest.approx(echo, rel=0.02, abs=0.02)


def ray_to_circle(beam: Beam, x: float, y: float, radius: float) -> Callable[[float], float]:
    dx, dy = x - beam.x_m, y - beam.y_m

    def met(off: float) -> float:
        angle = beam.direction_rad + off
        along = dx * math.cos(angle) + dy * math.sin(angle)
        square = radius**2 - (dx * dx + dy * dy - along**2)
        return along - math.sqrt(square) if square >= 0.0 and along > 0.0 else math.inf

    return met


def ray_to_wall(beam: Beam, x1: float, y1: float, x2: float, y2: float) -> Callable[[float], float]:
    wx, wy = x2 - x1, y2 - y1
    dx, dy = x1 - beam.x_m, y1 - beam.y_m

    def met(off: float) -> float:
        cosine, sine = math.cos(beam.direction_rad + off), math.sin(beam.direction_rad + off)
        across = cosine * wy - sine * wx
        if across == 0.0:
            return math.inf
        distance, share = (dx * wy - dy * wx) / across, (dx * sine - dy * cosine) / across
        return distance if distance > 0.0 and 0.0 <= share <= 1.0 else math.inf

    return met


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("head_start_deg", 91.0, "a place between the end stops at 90.0 to either side"),
        ("sonar_nearest_m", 6.0, "more than sonar_nearest_m, which is 6.0"),
        ("target", (1.0, math.nan), "finite x and y"),
        ("obstacles", ((1.0, 2.0, 0.0),), "finite x and y, and a radius above 0"),
        ("walls", ((1.0, 2.0, 1.0, 2.0),), "finite x and y of two different ends"),
    ],
)
def test_what_cannot_be_is_refused_with_what_was_expected(
    name: str, value: object, expected: str
) -> None:
    overrides: dict[str, Any] = {name: value}
    with pytest.raises(ValueError, match=r"^arena: ") as refusal:
        ArenaParameters(**overrides)
    assert f"{expected};" in f"{refusal.value};"


@pytest.mark.parametrize(
    "overrides",
    [
        {"target": (0.0, 0.24)},
        {"obstacles": ((0.0, -0.3, 0.2),)},
        {"walls": ((-1.0, 0.1, 1.0, 0.1),)},
        {"walls": ((-1.0, 0.15, 1.0, 0.15),)},  # as far away as its body reaches
    ],
)
def test_a_start_that_touches_something_is_refused(overrides: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"start is \(0\.0, 0\.0\), expected a place where"):
        ArenaParameters(**overrides)


def test_every_fault_is_listed_at_once() -> None:
    with pytest.raises(ValueError, match=r"^arena: ") as refusal:
        ArenaParameters(head_start_deg=91.0, sonar_nearest_m=6.0, target=(math.inf, 0.0))
    assert [fault.split()[0] for fault in str(refusal.value)[7:].split("; ")] == [
        "head_start_deg",
        "sonar_farthest_m",
        "target",
    ]


def test_shapes_are_the_target_then_obstacles_then_walls() -> None:
    parameters = ArenaParameters(obstacles=((3.0, 3.0, 0.5),), walls=((5.0, 0.0, 5.0, 1.0),))
    target, obstacle, wall = parameters.shapes
    assert parameters.circles == (target, obstacle)
    assert target.distance(2.0, 1.0) == -0.10
    assert wall.distance(6.0, 0.5) == 1.0
    assert parameters.clearance_m((3.0, 2.0)) == pytest.approx(1.0 - 0.5 - 0.15)


def test_the_probe_sends_the_truth_of_each_tick_once_sensors_have_caught_up() -> None:
    rig = ArenaRig(ArenaParameters(target=(0.0, 1.0), obstacles=()))
    rig.drive(0, 10, 10)
    order: list[str] = []
    probe = ArenaProbe(rig.arena, lambda: rig.now, lambda: order.append("sensors"))
    bench = AtomicBench(probe)
    for at_s in (0, 1):
        rig.now = at_s * SECOND
        bench.put(1000.0 * at_s, tick=True)
    y_m = 10 * M_PER_UNIT_S
    assert bench.said["x_m"] == [(0.0, 0.0), (1000.0, pytest.approx(0.0))]
    assert bench.said["y_m"] == [(0.0, 0.0), (1000.0, pytest.approx(y_m))]
    assert bench.values("heading_rad") == pytest.approx([math.pi / 2] * 2)
    first, second = bench.values("distance_m")
    assert first - second == pytest.approx(y_m)
    assert order == ["sensors"] * 2
