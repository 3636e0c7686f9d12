"""The map of a run: where the vehicle went, what it saw, and what stands about."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Final

from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.view.canvas import Canvas, Rectangle, point
from firmware_runtime.view.scales import Axis
from sim_doubles.worlds.arena import Arena, Pose
from sim_doubles.worlds.arena_geometry import Circle, Point
from sim_doubles.worlds.arena_log import ArenaLog, Ping, Stay

__all__ = ["GOAL_M", "ArenaMap"]

GOAL_M: Final = (0.05, 0.5)
"""Distance from the target's surface at which a run is to end: no nearer, no farther."""

_AROUND_M: Final = 0.35
_SAMPLE: Final = 50 * MILLISECOND
_ARROW: Final = 7.5
_ARROW_APART: Final = 70.0
_CHEVRON: Final = ((0.75, 0.0), (-0.55, 0.6), (-0.25, 0.0), (-0.55, -0.6))
_NOSE: Final = ((1.0, 0.0), (0.5, 0.2), (0.5, -0.2))
_ELSEWHERE_M: Final = 0.1
_TURNED_RAD: Final = 0.3
_MOVED: Final = 3.0
"""Pixels of the path in a state that are seen."""
_LONG_STAY: Final = 400 * MILLISECOND


class ArenaMap:
    """Metres on the page, equal in both directions, and what is drawn in them."""

    def __init__(self, page: Canvas, box: Rectangle, log: ArenaLog, until: int) -> None:
        self._page = page
        self._box = box
        self._log = log
        self._arena: Arena = log.arena
        self._parameters = log.arena.parameters
        self._until = until
        self._poses = [self._arena.pose(at) for at in [*range(0, until, _SAMPLE), until]]
        self._x, self._y = self._axes()
        self.path_hues: dict[str, str] = {}
        """The states in which the vehicle moved, and the colour class of each on the path."""

    def draw(self, stays: list[Stay], hues: dict[str, str]) -> None:
        """Draw everything; the path has the colours of these states."""
        with self._page.clipped(self._box):
            self._draw_grid()
            self._draw_sweep()
            self._draw_beams()
            self._draw_things()
            self._draw_path(stays, hues)
            self._draw_arrows()
            self._draw_edges()
            self._draw_vehicles(stays)
        self._draw_frame()

    # Scale

    def _axes(self) -> tuple[Axis, Axis]:
        """Axes that show everything, in the middle of the box."""
        xs, ys = zip(*self._extent(), strict=True)
        box = self._box
        west, east, south, north = min(xs), max(xs), min(ys), max(ys)
        m_per_pixel = max((east - west) / box.width, (north - south) / box.height)
        half_x, half_y = 0.5 * box.width * m_per_pixel, 0.5 * box.height * m_per_pixel
        x, y = 0.5 * (west + east), 0.5 * (south + north)
        return (
            Axis(x - half_x, x + half_x, box.left, box.right),
            Axis(y - half_y, y + half_y, box.bottom, box.top),
        )

    def _extent(self) -> list[Point]:
        """Corners of what is to be seen."""
        around = self._parameters.body_radius_m + _AROUND_M
        circles = [(pose.x_m, pose.y_m, around) for pose in self._poses]
        circles += [
            (circle.x_m, circle.y_m, circle.radius_m + GOAL_M[1] + 0.1)
            for circle in self._parameters.circles
        ]
        circles += [(x, y, radius + 0.1) for x, y, radius in self._parameters.low_obstacles]
        for x1, y1, x2, y2 in (*self._parameters.walls, *self._parameters.low_walls):
            circles += [(x1, y1, 0.1), (x2, y2, 0.1)]
        lower = [(x - radius, y - radius) for x, y, radius in circles]
        return lower + [(x + radius, y + radius) for x, y, radius in circles]

    def _at(self, x_m: float, y_m: float) -> Point:
        return (self._x.pixel(x_m), self._y.pixel(y_m))

    # What is seen

    def _draw_grid(self) -> None:
        for x in self._x.ticks(60.0):
            self._page.line(self._at(x, self._y.low), self._at(x, self._y.high), "grid")
        for y in self._y.ticks(60.0):
            self._page.line(self._at(self._x.low, y), self._at(self._x.high, y), "grid")

    def _draw_sweep(self) -> None:
        """All the radar's beams that brought no echo, as one figure."""
        farthest_m = self._parameters.sonar_farthest_m
        pings = [ping for ping in self._log.radar_pings if ping.echo_m == math.inf]
        self._page.path(" ".join(self._sector(ping, farthest_m) for ping in pings), "sweep")

    def _draw_things(self) -> None:
        for x1, y1, x2, y2 in self._parameters.walls:
            self._page.line(self._at(x1, y1), self._at(x2, y2), "wall")
        for x1, y1, x2, y2 in self._parameters.low_walls:
            self._page.line(self._at(x1, y1), self._at(x2, y2), "wall low")
        for low in self._parameters.low_obstacles:
            self._draw_disc(Circle(*low), 0.0, "obstacle low")
        target, *obstacles = self._parameters.circles
        self._draw_disc(target, GOAL_M[1], "goal")
        self._draw_disc(target, 0.0, "target")
        for obstacle in obstacles:
            self._draw_disc(obstacle, 0.0, "obstacle")

    def _draw_disc(self, circle: Circle, wider_m: float, css: str) -> None:
        centre = self._at(circle.x_m, circle.y_m)
        self._page.circle(centre, self._x.length(circle.radius_m + wider_m), css)

    def _draw_path(self, stays: list[Stay], hues: dict[str, str]) -> None:
        for state, since, until in stays or [Stay("", 0, self._until)]:
            instants = [since, *range(since + _SAMPLE, until, _SAMPLE), until]
            points = [self._at(*self._arena.pose(at)[:2]) for at in instants]
            hue = hues.get(state, "hue-brief")
            self._page.polyline(points, f"path {hue}")
            if hue != "hue-brief" or not hues:
                moved = sum(math.dist(*pair) for pair in pairwise(points)) > _MOVED
                self.path_hues.update({state: hue} if moved else {})

    def _draw_arrows(self) -> None:
        """An arrow head on the path every so many pixels."""
        gone, before = 0.5 * _ARROW_APART, self._poses[0]
        for pose in self._poses[1:]:
            gone += self._x.length(math.dist(before[:2], pose[:2]))
            before = pose
            if gone >= _ARROW_APART:
                gone -= _ARROW_APART
                self._page.polygon(self._turned(pose, _ARROW, _CHEVRON), "nose")

    def _echoes(self) -> Iterator[tuple[str, list[Ping]]]:
        """The radar's pings that brought an echo, and the body's last one if it did."""
        for css, pings in (("radar", self._log.radar_pings), ("body", self._log.body_pings[-1:])):
            yield css, [ping for ping in pings if ping.echo_m < math.inf]

    def _draw_beams(self) -> None:
        """Draw the beams of the echoes, one figure a sonar, on paper, so that no colours mix."""
        for css, pings in self._echoes():
            beams = " ".join(self._sector(ping, ping.echo_m) for ping in pings)
            for each in ("paper", f"beam {css}"):
                self._page.path(beams, each)

    def _draw_edges(self) -> None:
        """Draw where the echoes came from: somewhere on the far edges of the beams."""
        for css, pings in self._echoes():
            for ping in pings:
                self._page.path(f"M{self._arc(ping, ping.echo_m)}", f"edge {css}-edge")

    def _draw_vehicles(self, stays: list[Stay]) -> None:
        """The vehicle at the start, where it entered a state for long, and at the end."""
        began = [stay.since for stay in stays if stay.until - stay.since >= _LONG_STAY]
        drawn: list[Pose] = []
        for pose in map(self._arena.pose, [0, *began]):
            if all(_is_elsewhere(pose, other) for other in drawn):
                self._draw_body(pose, "ghost")
            if all(_is_elsewhere(pose, other) or _is_turned(pose, other) for other in drawn):
                self._draw_nose(pose, "ghost")
                drawn.append(pose)
        self._draw_body(self._poses[-1], "solid")
        self._draw_nose(self._poses[-1], "")

    def _draw_frame(self) -> None:
        page, box = self._page, self._box
        page.rectangle(box, "frame")
        for x in self._x.ticks(60.0):
            page.text((self._x.pixel(x), box.bottom + 16), f"{x:g}", "small note", "middle")
        for y in self._y.ticks(60.0):
            page.text((box.left - 7, self._y.pixel(y) + 4), f"{y:g}", "small note", "end")
        page.text((box.left + box.width / 2, box.bottom + 34), "x, east (m)", "note", "middle")
        page.text_upwards((box.left - 40, box.top + box.height / 2), "y, north (m)", "note")

    # Figures

    def _sector(self, ping: Ping, range_m: float) -> str:
        """The beam up to a range, in SVG's path language."""
        apex = self._at(ping.beam.x_m, ping.beam.y_m)
        return f"M{point(apex)} L{self._arc(ping, range_m)} Z"

    def _arc(self, ping: Ping, range_m: float) -> str:
        """The beam's far edge, from left to right."""
        x, y, direction, half = ping.beam
        left, right = (
            point(self._at(x + range_m * math.cos(angle), y + range_m * math.sin(angle)))
            for angle in (direction + half, direction - half)
        )
        radius = self._x.length(range_m)
        return f"{left} A{point((radius, radius))} 0 0 1 {right}"

    def _draw_body(self, pose: Pose, css: str) -> None:
        radius = self._x.length(self._parameters.body_radius_m)
        self._page.circle(self._at(pose.x_m, pose.y_m), radius, f"vehicle {css}")

    def _draw_nose(self, pose: Pose, css: str) -> None:
        """A mark at the vehicle's front."""
        radius = self._x.length(self._parameters.body_radius_m)
        self._page.polygon(self._turned(pose, radius, _NOSE), f"nose {css}")

    def _turned(self, pose: Pose, size: float, corners: Sequence[Point]) -> list[Point]:
        """A figure drawn for a vehicle that heads along x, at the pose and in pixels."""
        x, y = self._at(pose.x_m, pose.y_m)
        cosine, sine = math.cos(pose.heading_rad), math.sin(pose.heading_rad)
        return [
            (x + size * (cosine * along - sine * aside), y - size * (sine * along + cosine * aside))
            for along, aside in corners
        ]


def _is_elsewhere(pose: Pose, other: Pose) -> bool:
    return math.dist(pose[:2], other[:2]) > _ELSEWHERE_M


def _is_turned(pose: Pose, other: Pose) -> bool:
    return abs(pose.heading_rad - other.heading_rad) > _TURNED_RAD
