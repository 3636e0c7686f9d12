"""Where a beam first meets a circle or a wall: by hand, and against a fan of rays."""

import math
from collections.abc import Callable

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sim_doubles.worlds.arena_geometry import Beam, Circle, Wall

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


def test_nothing_behind_echoes() -> None:
    assert Circle(-1.0, 0.0, 0.5).echo(AHEAD) == math.inf
    assert Wall(-1.0, -3.0, -1.0, 3.0).echo(AHEAD) == math.inf


def test_a_sonar_inside_a_circle_receives_its_echo_at_once() -> None:
    assert Circle(0.0, 0.2, 0.3).echo(AHEAD) == 0.0


def test_a_wall_along_the_way_is_met_at_the_edge_of_the_beam() -> None:
    assert Wall(-3.0, 0.5, 9.0, 0.5).echo(AHEAD) == pytest.approx(0.5 / math.sin(TEN_DEG))
    assert Wall(-3.0, -0.5, 9.0, -0.5).echo(AHEAD) == pytest.approx(0.5 / math.sin(TEN_DEG))


def test_a_wall_is_as_far_from_a_point_as_its_nearest_part() -> None:
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
