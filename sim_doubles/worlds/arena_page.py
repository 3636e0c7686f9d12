"""A run in the arena as parts: the map, the distance to the target with the echoes, the states."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.view import parts
from firmware_runtime.view.parts import (
    Body,
    Bound,
    Lane,
    Lanes,
    Level,
    Page,
    Plane,
    Ray,
    Series,
    Shape,
    Text,
    curve,
)
from sim_doubles.worlds.arena import ArenaParameters, Pose
from sim_doubles.worlds.arena_geometry import Point
from sim_doubles.worlds.arena_log import ArenaLog, Ping, Stay

__all__ = ["GOAL_M", "arena_page", "arena_plane"]

GOAL_M: Final = (0.05, 0.5)
"""Distance from the target's surface at which a run is to end: no nearer, no farther."""

_AROUND_M: Final = 0.35
_SAMPLE: Final = 50 * MILLISECOND
_NOSE: Final = ((1.0, 0.0), (0.5, 0.2), (0.5, -0.2))
_ELSEWHERE_M: Final = 0.1
_TURNED_RAD: Final = 0.3
_MOVED_M: Final = 0.02
"""Least path in a state that the map's key names."""
_LONG_STAY: Final = 400 * MILLISECOND
_COLOURS: Final = 8
"""Of the palette; the path has those that its states have in their lane."""


def arena_page(
    log: ArenaLog, until: int, title: str, outcome: str = "", leading: str | None = None
) -> Page:
    """The run up to instant `until`; `outcome` says how it ended.

    The path has the colours of the states of the model `leading`, of the one that entered the log
    first if none is named.
    """
    models = log.stays(until)
    leading = next(iter(models), "") if leading is None else leading
    states = _states(models, until)
    colours = {state: f"colour{number % _COLOURS}" for number, state in enumerate(states.lasted)}
    shown: list[parts.Part] = [
        _map(log, until, models.get(leading, []), colours),
        _distance(log, until),
        *([states] if models else []),
    ]
    return Page(title=title, opening=[Text(text=outcome)] if outcome else [], parts=shown)


def arena_plane(parameters: ArenaParameters) -> Plane:
    """The arena with the vehicle, its head and what its sonars meet, as ports say."""
    origin, reach = Pose(0.0, 0.0, 0.0), parameters.sonar_farthest_m
    x, y = Bound("world.x_m"), Bound("world.y_m")
    head = 0.4 * parameters.body_radius_m
    west, east, south, north = _extent(parameters, [Pose(*parameters.start, 0.0)])
    return Plane(
        title="The arena from above, as it truly is; x to the east",
        shapes=list(_standing(parameters)),
        bodies=[
            Body(
                "the vehicle",
                _body_shapes(parameters, origin),
                x=x,
                y=y,
                heading_rad=Bound("world.heading_rad"),
                rays=[
                    Ray(
                        (parameters.body_radius_m, 0.0),
                        math.radians(parameters.body_half_angle_deg),
                        reach,
                        Bound("body_sonar.distance"),
                        name="body sonar",
                    )
                ],
                has_trail=True,
            ),
            Body(
                "the radar's head, by its compass",
                [Shape("polygon", _turned(origin, head, _NOSE), look="target")],
                x=x,
                y=y,
                heading_rad=Bound(
                    "radar_compass.heading_deg", scale=-math.pi / 180.0, offset=math.pi / 2.0
                ),
                rays=[
                    Ray(
                        (0.0, 0.0),
                        math.radians(parameters.radar_half_angle_deg),
                        reach,
                        Bound("radar_sonar.distance"),
                        name="radar",
                    )
                ],
            ),
        ],
        across_ends=(west, east),
        up_ends=(south, north),
    )


# The map ------------------------------------------------------------------------------------------


def _standing(parameters: ArenaParameters) -> Iterator[Shape]:
    """Yield what stands in the arena: walls, obstacles, the target with a ring round it."""
    for x1, y1, x2, y2 in parameters.walls:
        yield Shape("line", [(x1, y1), (x2, y2)], name="an obstacle, a wall")
    for x1, y1, x2, y2 in parameters.low_walls:
        yield Shape("line", [(x1, y1), (x2, y2)], look="low", name="a low one")
    for x, y, radius in parameters.low_obstacles:
        yield Shape("circle", [(x, y)], radius, look="low", name="a low one")
    target, *obstacles = parameters.circles
    for x, y, radius in obstacles:
        yield Shape("circle", [(x, y)], radius, name="an obstacle, a wall")
    at, radius = [(target.x_m, target.y_m)], target.radius_m
    around = f"{GOAL_M[1]:g} m around it"
    yield Shape("circle", at, radius + GOAL_M[1], look="goal", name=around)
    yield Shape("circle", at, radius, look="target", name="the target")


def _body_shapes(parameters: ArenaParameters, pose: Pose, look: str = "body") -> list[Shape]:
    """The vehicle at a pose, and a mark at its front."""
    radius = parameters.body_radius_m
    name = "the vehicle, its front" if look == "body" else "where it was before"
    return [
        Shape("circle", [(pose.x_m, pose.y_m)], radius, look=look, name=name),
        Shape("polygon", _turned(pose, radius, _NOSE), look="nose"),
    ]


def _map(log: ArenaLog, until: int, stays: list[Stay], colours: Mapping[str, str]) -> Plane:
    arena, parameters = log.arena, log.arena.parameters
    poses = [arena.pose(at) for at in [*range(0, until, _SAMPLE), until]]
    west, east, south, north = _extent(parameters, poses)
    return Plane(
        title="The arena from above, x to the east",
        shapes=[
            *_beams(log),
            *_standing(parameters),
            *_path(log, until, stays, colours),
            *_vehicles(log, stays),
            *_body_shapes(parameters, poses[-1]),
        ],
        across_ends=(west, east),
        up_ends=(south, north),
    )


def _extent(
    parameters: ArenaParameters, poses: Sequence[Pose]
) -> tuple[float, float, float, float]:
    """The west, east, south and north of what is to be seen."""
    around = parameters.body_radius_m + _AROUND_M
    circles = [(pose.x_m, pose.y_m, around) for pose in poses]
    circles += [(x, y, radius + GOAL_M[1] + 0.1) for x, y, radius in parameters.circles]
    circles += [(x, y, radius + 0.1) for x, y, radius in parameters.low_obstacles]
    for x1, y1, x2, y2 in (*parameters.walls, *parameters.low_walls):
        circles += [(x1, y1, 0.1), (x2, y2, 0.1)]
    return (
        min(x - radius for x, _, radius in circles),
        max(x + radius for x, _, radius in circles),
        min(y - radius for _, y, radius in circles),
        max(y + radius for _, y, radius in circles),
    )


def _beams(log: ArenaLog) -> Iterator[Shape]:
    """Yield the radar's pings, of those alike the last, and the body's last if it met something.

    Each is paler than its colour: many on top of one another would hide what is below.
    """
    farthest_m = log.arena.parameters.sonar_farthest_m
    for ping in _unlike([ping for ping in log.radar_pings if ping.echo_m == math.inf], 0.5):
        yield _sector(ping, farthest_m, "ray", "radar, no echo")
    for ping in _unlike([ping for ping in log.radar_pings if ping.echo_m < math.inf], 0.1):
        yield _sector(ping, ping.echo_m, "echo", "radar, echo")
    for ping in log.body_pings[-1:]:
        if ping.echo_m < math.inf:
            yield _sector(ping, ping.echo_m, "echo", "body sonar, last echo", "garbage")


def _unlike(pings: Sequence[Ping], apart_m: float) -> Iterable[Ping]:
    """Pings from places so far apart, or in other directions by half a beam."""
    return {
        (
            round(ping.beam.x_m / apart_m),
            round(ping.beam.y_m / apart_m),
            round(ping.beam.direction_rad / ping.beam.half_angle_rad),
        ): ping
        for ping in pings
    }.values()


def _sector(ping: Ping, range_m: float, look: str, name: str, colour: str = "") -> Shape:
    x, y, direction, half = ping.beam
    return Shape("sector", [(x, y)], range_m, direction, half, look, name, colour)


def _path(
    log: ArenaLog, until: int, stays: list[Stay], colours: Mapping[str, str]
) -> Iterator[Shape]:
    """Yield the path in each state; those in which it moved have a name."""
    for state, since, end in stays or [Stay("", 0, until)]:
        instants = [since, *range(since + _SAMPLE, end, _SAMPLE), end]
        points = [(pose.x_m, pose.y_m) for pose in map(log.arena.pose, instants)]
        moved = sum(math.dist(*pair) for pair in pairwise(points)) > _MOVED_M
        name = f"its path: {state}" if state else "its path"
        colour = colours.get(state, "")
        yield Shape("line", points, look="path", name=name if moved else "", colour=colour)


def _vehicles(log: ArenaLog, stays: list[Stay]) -> Iterator[Shape]:
    """Yield the vehicle at the start and where it entered a state for long."""
    began = [stay.since for stay in stays if stay.until - stay.since >= _LONG_STAY]
    drawn: list[Pose] = []
    for pose in map(log.arena.pose, [0, *began]):
        if all(_is_elsewhere(pose, other) or _is_turned(pose, other) for other in drawn):
            drawn.append(pose)
            yield from _body_shapes(log.arena.parameters, pose, "ghost")


def _turned(pose: Pose, size: float, corners: Sequence[Point]) -> list[Point]:
    """A figure drawn for a vehicle that heads along x, at the pose."""
    cosine, sine = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
    return [
        (
            pose.x_m + size * (cosine * along - sine * aside),
            pose.y_m + size * (sine * along + cosine * aside),
        )
        for along, aside in corners
    ]


def _is_elsewhere(pose: Pose, other: Pose) -> bool:
    return math.dist(pose[:2], other[:2]) > _ELSEWHERE_M


def _is_turned(pose: Pose, other: Pose) -> bool:
    return abs(pose.heading_rad - other.heading_rad) > _TURNED_RAD


# Over time ----------------------------------------------------------------------------------------


def _distance(log: ArenaLog, until: int) -> Series:
    """The distance to the target, the echoes, and where the robot is to stop."""
    step = max(1, until // 800)
    instants = [*range(0, until, step), until]
    way = [(at / SECOND, log.arena.distance_to_target(at)) for at in instants]
    top = 1.08 * max(GOAL_M[1], *(metres for _, metres in way))
    return Series(
        "Distance to the target",
        "s",
        "m",
        [
            curve("distance", way),
            curve("radar, echo", _echoes(log.radar_pings, top), "dots", "doubtful"),
            curve("body sonar, echo", _echoes(log.body_pings, top), "dots", "garbage"),
        ],
        levels=[Level(GOAL_M[0], "no nearer"), Level(GOAL_M[1], "no farther")],
        across_ends=(0.0, max(until, MILLISECOND) / SECOND),
        up_ends=(0.0, top),
    )


def _echoes(pings: Sequence[Ping], below: float) -> list[tuple[float, float]]:
    return [(ping.at / SECOND, ping.echo_m) for ping in pings if ping.echo_m < below]


def _states(models: Mapping[str, Sequence[Stay]], until: int) -> Lanes:
    lanes = [
        Lane(model, [parts.Stay(s.state, s.since / SECOND, s.until / SECOND) for s in stays])
        for model, stays in models.items()
    ]
    return Lanes(title="States", lanes=lanes, ends=(0.0, max(until, MILLISECOND) / SECOND))
