"""The parts of a run in the arena: true to the arena and to the log, nothing left out."""

import math
from collections.abc import Iterator
from itertools import pairwise

import pytest

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.view.parts import Bound, Lanes, Page, Plane, Series, Shape, Text
from sim_doubles.worlds.arena import ArenaParameters
from sim_doubles.worlds.arena_log import ArenaLog, Stay
from sim_doubles.worlds.arena_page import arena_page, arena_plane
from tests.support.arena_mission import ArenaMission
from tests.support.arena_rig import ArenaRig


@pytest.fixture(scope="module")
def mission() -> ArenaMission:
    parameters = ArenaParameters(
        target=(1.5, 1.2), obstacles=((-2.0, 1.0, 0.3),), walls=((-3.0, -1.0, 3.0, -1.0),)
    )
    done = ArenaMission(parameters)
    done.run()
    return done


@pytest.fixture(scope="module")
def page(mission: ArenaMission) -> Page:
    return arena_page(mission.log, mission.at, "found it", "It stopped.")


def plane(page: Page) -> Plane:
    (found,) = (part for part in page.parts if isinstance(part, Plane))
    return found


def shapes(page: Page, look: str) -> Iterator[Shape]:
    return (each for each in plane(page).shapes if each.look == look)


def series(page: Page) -> Series:
    (found,) = (part for part in page.parts if isinstance(part, Series))
    return found


def test_title_and_outcome_are_the_page_s(page: Page) -> None:
    assert page.title == "found it"
    assert page.opening == [Text(text="It stopped.")]


def test_every_ping_of_the_radar_is_a_sector_as_long_as_it_reached(
    mission: ArenaMission, page: Page
) -> None:
    pings = mission.log.radar_pings
    echoes = [ping for ping in pings if ping.echo_m < math.inf]
    assert len(echoes) == 1
    (radar,) = (each for each in shapes(page, "echo") if each.name == "radar, echo")
    assert radar.radius == echoes[0].echo_m
    assert radar.points == [(echoes[0].beam.x_m, echoes[0].beam.y_m)]
    rays = list(shapes(page, "ray"))
    assert len(rays) == len(pings) - 1
    assert {each.radius for each in rays} == {mission.rig.arena.parameters.sonar_farthest_m}


def test_the_vehicle_ends_on_the_map_where_it_ended_in_the_arena(
    mission: ArenaMission, page: Page
) -> None:
    end = mission.rig.arena.pose(mission.at)
    (body,) = shapes(page, "body")
    assert body.points == [(end.x_m, end.y_m)]
    nose = list(shapes(page, "nose"))[-1].points[0]
    assert nose == pytest.approx(end.ahead(body.radius))


def test_what_stands_in_the_arena_is_on_the_map(page: Page) -> None:
    (target,), (goal,) = shapes(page, "target"), shapes(page, "goal")
    assert (target.points, target.radius) == ([(1.5, 1.2)], 0.1)
    assert (goal.points, goal.radius) == ([(1.5, 1.2)], 0.6)
    wall, obstacle = shapes(page, "thing")
    assert wall.points == [(-3.0, -1.0), (3.0, -1.0)]
    assert (obstacle.points, obstacle.radius) == ([(-2.0, 1.0)], 0.3)


def test_a_vehicle_that_moves_is_drawn_round_its_centre_with_nose_and_sonar_at_its_front() -> None:
    vehicle, head = arena_plane(ArenaParameters()).bodies
    body, nose = vehicle.shapes
    (ahead,), (radar,) = vehicle.rays, head.rays
    assert body.points == [(0.0, 0.0)]
    assert ahead.at == (body.radius, 0.0)
    assert nose.points[0] == pytest.approx(ahead.at)
    assert radar.at == (0.0, 0.0)
    bearing = head.heading_rad
    assert isinstance(bearing, Bound)
    shown = [bearing.offset + bearing.scale * degrees for degrees in (0.0, 90.0)]
    assert shown == pytest.approx([math.pi / 2, 0.0]), "north is up, east to the right"
    (pointer,) = head.shapes
    x_m, y_m = pointer.points[0]
    assert 0.0 < x_m < body.radius
    assert y_m == 0.0


def test_the_path_is_whole_and_has_the_colours_of_its_states(page: Page) -> None:
    paths = list(shapes(page, "path"))
    for before, after in pairwise(paths):
        assert before.points[-1] == after.points[0]
    moved = {each.name for each in paths if each.name}
    assert moved == {"its path: search", "its path: approach"}
    assert len({each.colour for each in paths}) == 5
    west, east = plane(page).across_ends or (0.0, 0.0)
    assert all(west < x < east for each in paths for x, _ in each.points)


def test_the_distance_is_that_of_the_arena_with_the_echoes_as_dots(
    mission: ArenaMission, page: Page
) -> None:
    distance, radar, body = series(page).curves
    at = mission.at / SECOND
    assert distance.points[-1] == (at, mission.rig.arena.distance_to_target(mission.at))
    assert (radar.style, body.style) == ("dots", "dots")
    assert len(radar.x) == 1
    assert [each.value for each in series(page).levels] == [0.05, 0.5]


def test_the_states_follow_one_another_to_the_end(mission: ArenaMission, page: Page) -> None:
    (lanes,) = (part for part in page.parts if isinstance(part, Lanes))
    (lane,) = lanes.lanes
    assert lane.name == "mission"
    assert {stay.state for stay in lane.stays} == {"search", "look", "turn", "approach", "stop"}
    assert lane.stays[-1].end == mission.at / SECOND


def test_a_run_without_pings_and_states_or_that_ended_at_once_is_shown_too() -> None:
    rig = ArenaRig()
    rig.drive(0, 10, 10)
    page = arena_page(ArenaLog(rig.arena), 3 * SECOND, "drive")
    (path,) = shapes(page, "path")
    assert path.name == "its path"
    assert [type(each) for each in page.parts] == [Plane, Series]
    log = ArenaLog(ArenaRig().arena)
    log.enter(0, "controller", "Idle")
    assert len(list(shapes(arena_page(log, 0, "nothing"), "target"))) == 1


def test_a_vehicle_is_drawn_again_where_it_has_turned_and_not_where_it_stayed() -> None:
    rig = ArenaRig()
    log = ArenaLog(rig.arena)
    log.enter(0, "controller", "Idle")
    log.enter(SECOND, "controller", "Look")
    assert len(list(shapes(arena_page(log, 2 * SECOND, "still"), "ghost"))) == 1
    rig.drive(2 * SECOND, 20, -20)
    log.enter(3 * SECOND, "controller", "Idle")
    assert len(list(shapes(arena_page(log, 4 * SECOND, "turned"), "ghost"))) == 2


def test_the_log_gives_the_arenas_echoes_and_the_stays_between_entries() -> None:
    rig = ArenaRig(ArenaParameters(target=(0.0, 1.0)))
    log = ArenaLog(rig.arena)
    assert log.body_echoes(0) == rig.arena.body_echoes(0)
    assert log.radar_echoes(5) == rig.arena.radar_echoes(5)
    assert [ping.echo_m for ping in log.body_pings] == [pytest.approx(0.75)]
    assert [(ping.at, ping.beam) for ping in log.radar_pings] == [(5, rig.arena.radar_beam(5))]
    log.enter(0, "radar", "Idle")
    log.enter(4, "radar", "Passing")
    log.enter(4, "radar", "Turning")
    assert log.stays(9) == {"radar": [Stay("Idle", 0, 4), Stay("Turning", 4, 9)]}


def test_a_hop_of_ten_milliseconds_has_its_place_among_the_states() -> None:
    log = ArenaLog(ArenaRig().arena)
    log.enter(0, "controller", "Long")
    log.enter(SECOND, "controller", "Hop")
    log.enter(SECOND + 10 * MILLISECOND, "controller", "Long")
    (lanes,) = (p for p in arena_page(log, 10 * SECOND, "t").parts if isinstance(p, Lanes))
    assert [(e.state, e.begin) for e in lanes.lanes[0].stays][1] == ("Hop", 1.0)
