"""The picture of a run in the arena, as SVG: map, distance to the target, echoes, states.

It needs nothing but Python. Text is set in the reader's own letters, colours follow the reader's
light or dark scheme.
"""

from collections.abc import Mapping
from textwrap import wrap
from typing import Final

from firmware_runtime.view.canvas import Canvas, Rectangle, file_text, text_width
from sim_doubles.worlds.arena_geometry import Point
from sim_doubles.worlds.arena_log import ArenaLog
from sim_doubles.worlds.arena_picture_map import ArenaMap
from sim_doubles.worlds.arena_picture_style import STYLE
from sim_doubles.worlds.arena_picture_time import Timeline, hues_of

__all__ = ["draw_run"]

_WIDTH: Final = 1040.0
_MAP: Final = Rectangle(72.0, 58.0, 740.0, 560.0)
_KEY: Final = Rectangle(832.0, 58.0, 188.0, 560.0)
_TIMELINE: Final = Rectangle(150.0, 676.0, 870.0, 0.0)
_MARGIN: Final = 20.0
_LETTERS: Final = int((_WIDTH - 2 * _MARGIN) / text_width("x"))

_KEY_LINES: Final = (
    ("target", "the target"),
    ("goal", "0.5 m around it"),
    ("vehicle solid", "the vehicle, its front"),
    ("vehicle ghost", "where it was before"),
    ("sweep", "radar, no echo"),
    ("radar", "radar, echo"),
    ("body", "body sonar, last echo"),
    ("obstacle", "an obstacle, a wall; paler: low"),
    ("line", "distance to the target"),
)


def draw_run(
    log: ArenaLog, until: int, title: str, outcome: str = "", leading: str | None = None
) -> str:
    """The run up to instant `until` as the text of an SVG file.

    `outcome` says how it ended. The path has the colours of the states of the model `leading`, of
    the one that entered the log first if none is named.
    """
    page = Canvas()
    models = log.stays(until)
    hues = hues_of(models, until)
    leading = next(iter(models), "") if leading is None else leading
    page.text((_MARGIN, 22.0), title, "title")
    for number, line in enumerate(wrap(outcome, _LETTERS, max_lines=2, placeholder=" ...")):
        page.text((_MARGIN, 38.0 + 14 * number), line, "note")
    drawn = ArenaMap(page, _MAP, log, until)
    drawn.draw(models.get(leading, []), hues.get(leading, {}))
    _draw_key(page, drawn.path_hues)
    bottom = Timeline(page, _TIMELINE, log, until).draw(models, hues)
    whole = Rectangle(0.0, 0.0, _WIDTH, bottom + _MARGIN)
    return file_text(page.svg(whole, f"{title}: {outcome}" if outcome else title, STYLE))


def _draw_key(page: Canvas, path_hues: Mapping[str, str]) -> None:
    """Say what the figures on the map, and the colours of the path, stand for."""
    paths = [
        (f"path {hue}", f"its path: {state}" if state else "its path")
        for state, hue in path_hues.items()
    ]
    for index, (figure, words) in enumerate((*_KEY_LINES[:4], *paths, *_KEY_LINES[4:])):
        x, y = _KEY.left + 14, _KEY.top + 14 + 28 * index
        _draw_figure(page, figure, (x, y))
        page.text((x + 24, y + 4), words, "small")


def _draw_figure(page: Canvas, figure: str, at: Point) -> None:
    x, y = at
    fan = [(x - 12, y + 5), (x + 10, y - 8), (x + 12, y + 2)]
    if figure == "target":
        page.circle(at, 7, "target")
    elif figure == "goal":
        page.circle(at, 9, "goal")
    elif figure.startswith("vehicle"):
        page.circle(at, 9, figure)
        page.polygon([(x + 8.5, y), (x + 4, y - 3), (x + 4, y + 3)], f"nose {figure[8:]}")
    elif figure.startswith("path"):
        page.line((x - 10, y), (x + 10, y), figure)
    elif figure == "line":
        page.line((x - 10, y), (x + 10, y), "line")
    elif figure == "sweep":
        page.polygon(fan, "sweep")
    elif figure == "obstacle":
        page.circle((x - 5, y), 5, "obstacle")
        page.line((x + 6, y - 6), (x + 6, y + 6), "wall")
    else:
        page.polygon(fan, f"beam {figure}")
        page.line(fan[1], fan[2], f"edge {figure}-edge")
