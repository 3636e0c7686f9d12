"""Timeline of a run: the distance to the target, the echoes and the states."""

import math
from collections.abc import Mapping
from typing import Final

from firmware_runtime.devs.time import MILLISECOND, SECOND
from firmware_runtime.view.canvas import Canvas, Rectangle, text_width
from firmware_runtime.view.scales import Axis
from sim_doubles.worlds.arena_log import ArenaLog, Ping, Stay
from sim_doubles.worlds.arena_picture_map import GOAL_M
from sim_doubles.worlds.arena_picture_style import HUES

__all__ = ["Timeline", "hues_of"]

_STRIP: Final = 110.0
_LANE: Final = 24.0
_GAP: Final = 8.0
_BRIEF: Final = 0.005
"""States that last a smaller share of the run have no colour of their own."""


def hues_of(models: Mapping[str, list[Stay]], until: int) -> dict[str, dict[str, str]]:
    """A colour class for each state of each model, no two alike as long as there are colours.

    States that last longest come first; the brief ones share a colour.
    """
    lasting: dict[tuple[str, str], int] = {}
    for model, stays in models.items():
        for stay in stays:
            key = model, stay.state
            lasting[key] = lasting.get(key, 0) + stay.until - stay.since
    long = [key for key, span in lasting.items() if span >= _BRIEF * until]
    long.sort(key=lasting.__getitem__, reverse=True)
    hues = {key: f"hue{index}" for index, key in enumerate(long[:HUES])}
    return {
        model: {stay.state: hues.get((model, stay.state), "hue-brief") for stay in stays}
        for model, stays in models.items()
    }


class Timeline:
    """A strip with the distance, and below it a lane for each model."""

    def __init__(self, page: Canvas, box: Rectangle, log: ArenaLog, until: int) -> None:
        self._page = page
        self._log = log
        self._until = until
        self._strip = box._replace(height=_STRIP)
        self._time = Axis(0.0, max(until, MILLISECOND) / SECOND, box.left, box.right)

    def draw(self, models: Mapping[str, list[Stay]], hues: Mapping[str, dict[str, str]]) -> float:
        """Draw everything; return the y below it."""
        self._draw_distance()
        bottom = self._strip.bottom + _GAP
        for model, stays in models.items():
            bottom = self._draw_model(bottom, model, stays, hues[model])
        for seconds in self._time.ticks(60.0):
            place = (self._time.pixel(seconds), bottom + 12)
            self._page.text(place, f"{seconds:g}", "small note", "middle")
        middle = 0.5 * (self._time.begin + self._time.end)
        self._page.text((middle, bottom + 30), "time (s)", "note", "middle")
        return bottom + 30

    # The distance

    def _draw_distance(self) -> None:
        page, box = self._page, self._strip
        step = max(1, self._until // 800)
        instants = [*range(0, self._until, step), self._until]
        distances = [self._log.arena.distance_to_target(at) for at in instants]
        axis = Axis(0.0, 1.08 * max(*distances, GOAL_M[1]), box.bottom, box.top)
        near, far = (axis.pixel(metres) for metres in GOAL_M)
        page.rectangle(Rectangle(box.left, far, box.width, near - far), "goal-zone")
        for seconds in self._time.ticks(60.0):
            x = self._time.pixel(seconds)
            page.line((x, box.top), (x, box.bottom), "grid")
        for metres in axis.ticks(28.0):
            y = axis.pixel(metres)
            page.line((box.left, y), (box.right, y), "grid")
            page.text((box.left - 7, y + 4), f"{metres:g}", "small note", "end")
        self._draw_pings(self._log.radar_pings, axis, "radar")
        self._draw_pings(self._log.body_pings, axis, "body")
        points = [
            (self._time.pixel(at / SECOND), axis.pixel(distance))
            for at, distance in zip(instants, distances, strict=True)
        ]
        page.polyline(points, "line")
        page.rectangle(box, "frame")
        page.text_upwards((box.left - 40, box.top + box.height / 2), "distance (m)", "note")

    def _draw_pings(self, pings: list[Ping], axis: Axis, css: str) -> None:
        for ping in pings:
            if ping.echo_m < axis.high:
                place = (self._time.pixel(ping.at / SECOND), axis.pixel(ping.echo_m))
                self._page.circle(place, 1.8, css)

    # The states

    def _draw_model(
        self, top: float, model: str, stays: list[Stay], hues: Mapping[str, str]
    ) -> float:
        """Draw a model's states, below it the names that found no room; return the y below."""
        self._page.text((self._time.begin - 10, top + 16), model, "small", "end")
        named: set[str] = set()
        for stay in stays:
            box = self._box_of(stay, top)
            self._page.rectangle(box, hues[stay.state], _tooltip(stay))
            if text_width(stay.state) <= box.width:
                place = (box.left + box.width / 2, top + 16)
                self._page.text(place, stay.state, "small on-hue", "middle")
                named.add(stay.state)
        unnamed = {state: hue for state, hue in hues.items() if state not in named}
        return self._draw_key(top + _LANE, unnamed)

    def _box_of(self, stay: Stay, top: float) -> Rectangle:
        left, right = (self._time.pixel(at / SECOND) for at in (stay.since, stay.until))
        return Rectangle(left, top, max(right - left, 1.0), _LANE)

    def _draw_key(self, top: float, hues: dict[str, str]) -> float:
        """Name colours, as many a line as fit; return the y below."""
        x, y = self._time.begin, top + 16
        coloured = {state: hue for state, hue in hues.items() if hue != "hue-brief"}
        for state, hue in coloured.items():
            width = 16 + text_width(state) + 10
            if x + width > self._time.end and x > self._time.begin:
                x, y = self._time.begin, y + 18
            self._page.rectangle(Rectangle(x, y - 9, 10, 10), hue)
            self._page.text((x + 16, y), state, "small")
            x += width
        return y + 14 if coloured else top + _GAP


def _tooltip(stay: Stay) -> str:
    span = stay.until - stay.since
    decimals = max(0, 3 - math.floor(math.log10(max(span, 1) / SECOND) + 1))
    return f"{stay.state}: {stay.since / SECOND:.3f} s, for {span / SECOND:.{decimals}f} s"
