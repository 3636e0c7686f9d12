"""Parts as a picture, SVG or PNG, drawn by matplotlib: one below the other, in light colours.

Imported only where something is drawn: a run is over by then, and what it loads has no matplotlib.
Text stays text, so names are searched for in an SVG; equal parts make an equal file.
"""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from io import BytesIO
from itertools import pairwise
from math import degrees, nan
from textwrap import wrap
from typing import Any, Final, TypeAlias

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, Polygon, Wedge
from matplotlib.ticker import FuncFormatter

from firmware_runtime.statistics.number_formats import round_duration
from firmware_runtime.view.palette import PALETTE
from firmware_runtime.view.parts import (
    LANE,
    Curve,
    Histogram,
    Lanes,
    Level,
    Number,
    Part,
    Plane,
    Series,
    Shape,
    all_parts,
)

Picture: TypeAlias = Series | Histogram | Lanes | Plane
Handle: TypeAlias = Line2D | Patch

_WIDTH: Final = 9.6
"""Inches; 100 pixels each in an SVG, 200 in a PNG."""
_LETTERS: Final = 110
"""Letters side by side."""
_MARGIN: Final = 0.9
"""Inches above and below the axes of a plot, for its title and its marks."""
_LANE: Final = 0.3
_SEEN: Final = 0.005
"""Share of the time from which on a state is named in a legend."""
_BELOW: Final = 0.42
"""Inches from the axes to a legend below them, and what a row of it takes."""
_LEGEND: Final = 0.2


def picture_of(form: str, title: str, parts: Sequence[Part], said: str = "") -> bytes:
    """A file of form `svg` or `png` with the parts that are pictures, under a title and a text."""
    drawn = [each for each in all_parts(parts) if isinstance(each, Picture)]
    with _settings():
        heading = "\n".join([title, *wrap(said, _LETTERS)])
        heights = [_inner(each) for each in drawn] or [0.5]
        size = _WIDTH, sum(map(_height, drawn)) + 0.3 + 0.2 * len(heading.splitlines())
        figure = Figure(figsize=size, layout="constrained", facecolor=_colour("paper"))
        figure.suptitle(heading, x=0.01, ha="left", color=_colour("ink"), fontsize=11)
        rows = figure.subplots(len(heights), 1, squeeze=False, height_ratios=heights)[:, 0]
        for axes, part in zip(rows, drawn, strict=False):
            _dress(axes)
            axes.set_title(part.title, color=_colour("ink"), pad=10)
            _draw(axes, part)
        if not drawn:
            rows[0].set_axis_off()
        metadata = {"Title": heading, **({"Date": None} if form == "svg" else {})}
        figure.savefig(file := BytesIO(), format=form, dpi=200, metadata=metadata)
    return file.getvalue()


def _settings() -> AbstractContextManager[None]:
    """Return settings in which names are text, whatever letters they have."""
    return rc_context(
        {
            "svg.fonttype": "none",
            "svg.hashsalt": "firmware-runtime",
            "text.parse_math": False,
            "font.size": 9,
            "axes.titlesize": 10,
            "axes.titleweight": "bold",
            "axes.titlelocation": "left",
        }
    )


def _colour(name: str) -> str:
    return PALETTE[name][0]


def _of_place(place: int) -> str:
    return _colour(f"colour{place % 8}")


def _height(part: Picture) -> float:
    """Inches that a picture takes."""
    return _inner(part) + _MARGIN + _LEGEND * _rows(_named(part))


def _inner(part: Picture) -> float:
    """Inches that its axes take."""
    if isinstance(part, Lanes):
        return _LANE * len(part.lanes) * part.height / LANE
    is_square = isinstance(part, Plane) or (isinstance(part, Series) and part.has_equal_scales)
    return 5.5 if is_square else 2.3


def _named(part: Picture) -> list[str]:
    """The names in its legend."""
    match part:
        case Series() if len(part.curves) > 1:
            return [curve.name for curve in part.curves]
        case Lanes():
            return [*_lasting(part), *part.colours]
        case Plane():
            return list(dict.fromkeys(each.name for each in _shapes(part) if each.name))
    return []


def _columns(names: Sequence[str]) -> int:
    longest = max(map(len, names), default=0)
    return max(1, min(len(names), _LETTERS // (longest + 9)))


def _rows(names: Sequence[str]) -> int:
    return -(-len(names) // _columns(names))


def _draw(axes: Axes, part: Picture) -> None:
    match part:
        case Series():
            handles = _draw_series(axes, part)
        case Histogram():
            handles = _draw_histogram(axes, part)
        case Lanes():
            handles = _draw_lanes(axes, part)
        case Plane():
            handles = _draw_plane(axes, part)
    if names := _named(part):
        _legend(axes, [handles[name] for name in names], names, _BELOW / _inner(part))


def _dress(axes: Axes) -> None:
    """Grid and colours of the axes."""
    axes.grid(color=_colour("line"), linewidth=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(colors=_colour("quiet"), length=0)
    for side in axes.spines.values():
        side.set_visible(False)


def _legend(axes: Axes, handles: Sequence[Handle], names: Sequence[str], below: float) -> None:
    """Names below the axes, by a share of their height."""
    axes.legend(
        handles,
        [f" {name}" if name.startswith("_") else name for name in names],  # it would be left out
        loc="upper left",
        bbox_to_anchor=(0.0, -below),
        ncols=_columns(names),
        frameon=False,
        borderaxespad=0.0,
        labelcolor=_colour("ink"),
    )


def _name_axis(axis: Any, label: str) -> None:  # noqa: ANN401 -- either of two classes
    """Its unit, or with `ns` marks that are times."""
    if label == "ns":
        axis.set_major_formatter(FuncFormatter(lambda ns, _: round_duration(round(ns))))
        return
    axis.set_label_text(label, color=_colour("quiet"))
    if axis.get_scale() == "log":
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,g}"))


def _set_ends(axes: Axes, part: Series | Plane) -> None:
    if part.across_ends is not None:
        axes.set_xlim(*part.across_ends)
    if part.up_ends is not None:
        axes.set_ylim(*part.up_ends)


def _make_equal(axes: Axes, part: Series | Plane) -> None:
    """A unit is as long across as it is up; ends that the part states stay as they are."""
    is_fixed = part.across_ends is not None and part.up_ends is not None
    axes.set_aspect("equal", adjustable="box" if is_fixed else "datalim")


# Curves -------------------------------------------------------------------------------------------


def _draw_series(axes: Axes, part: Series) -> dict[str, Handle]:
    for span in part.spans:
        axes.axvspan(span.begin, span.end, color=_colour("doubtful"), alpha=0.18, linewidth=0)
        _write(axes, ((span.begin + span.end) / 2, 0.98), span.name, "center", "quiet")
    handles: dict[str, Handle] = {}
    for place, curve in enumerate(part.curves):
        after = len(part.curves) - place - 1
        width = 1.6 + (after if part.is_nested else 0)
        handles[curve.name] = _draw_curve(axes, place, curve, width)
    if part.is_log:
        axes.set_yscale("log")
    _name_axis(axes.xaxis, part.across)
    _name_axis(axes.yaxis, part.up)
    axes.minorticks_off()
    _set_ends(axes, part)
    if part.has_equal_scales:
        _make_equal(axes, part)
    for level in part.levels:
        _draw_level(axes.axhline, level)
        left = axes.get_xlim()[0]
        axes.text(left, level.value, f" {level.name}", color=_of_level(level), va="bottom")
    return handles


def _draw_curve(axes: Axes, place: int, curve: Curve, width: float) -> Handle:
    x, y = _floats(curve.x), _floats(curve.y)
    own = "quiet" if curve.style == "dashed" else f"colour{place % 8}"
    colour = _colour(curve.colour or own)
    if curve.style == "columns":
        widths = [after - before for before, after in pairwise(x)]
        axes.bar(x, y, [*widths, *(widths[-1:] or [1.0])], align="edge", color=colour)
        return Patch(color=colour)
    if curve.style == "dots":
        (line,) = axes.plot(x, y, ".", color=colour, alpha=0.6, markersize=4)
    elif curve.style == "steps":
        (line,) = axes.plot(x, y, color=colour, linewidth=width, drawstyle="steps-post")
    else:
        dash = "--" if curve.style == "dashed" else "-"
        width = 1.6 if curve.style == "dashed" else width
        (line,) = axes.plot(x, y, dash, color=colour, linewidth=width)
    return line


def _floats(numbers: Sequence[Number]) -> list[float]:
    """The numbers; what was not measured is none, and leaves a gap."""
    return [nan if each is None else float(each) for each in numbers]


def _draw_histogram(axes: Axes, part: Histogram) -> dict[str, Handle]:
    widths = [after - before for before, after in pairwise(part.edges)]
    axes.bar(part.edges[:-1], part.counts, widths, align="edge", color=_colour("blue"), linewidth=0)
    if part.is_log:
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(bottom=0.6)
    _name_axis(axes.xaxis, part.across)
    _name_axis(axes.yaxis, "samples")
    axes.minorticks_off()
    for row, level in enumerate(part.levels):
        _draw_level(axes.axvline, level)
        _write(axes, (level.value, 0.98 - 0.08 * row), f" {level.name}", "left", "ink")
    return {}


def _draw_level(line: Callable[..., object], level: Level) -> None:
    dash = "--" if level.is_limit else "-"
    line(level.value, color=_of_level(level), linewidth=1, linestyle=dash)


def _of_level(level: Level) -> str:
    return _colour("doubtful" if level.is_limit else "ink")


def _write(axes: Axes, at: tuple[float, float], words: str, side: str, colour: str) -> None:
    """Words at a value across, and a share of the way up."""
    transform = axes.get_xaxis_transform()
    axes.text(*at, words, ha=side, va="top", color=_colour(colour), transform=transform)


# States and places --------------------------------------------------------------------------------


def _lasting(part: Lanes) -> list[str]:
    """The states that take a share of the time that is seen."""
    begin, end = part.reach
    return [state for state, span in part.lasted.items() if span >= _SEEN * (end - begin)]


def _draw_lanes(axes: Axes, part: Lanes) -> dict[str, Handle]:
    colours = {state: _of_place(place) for place, state in enumerate(part.lasted)}
    ends = part.reach
    for row, lane in enumerate(part.lanes):
        for stay in lane.stays:
            span, colour = stay.end - stay.begin, colours[stay.state]
            axes.barh(-row, span, 0.8, stay.begin, color=colour, linewidth=0)
            if len(stay.state) < _LETTERS * span / (ends[1] - ends[0]):
                middle = (stay.begin + stay.end) / 2
                axes.text(middle, -row, stay.state, color="white", ha="center", va="center")
        at = [mark.at for mark in lane.marks]
        heights = [mark.height - 0.5 - row for mark in lane.marks]
        shades = [_colour(mark.colour) for mark in lane.marks]
        axes.scatter(at, heights, s=6, c=shades, linewidths=0, zorder=2)
    axes.set_yticks([-row for row in range(len(part.lanes))], [lane.name for lane in part.lanes])
    axes.set_xlim(*ends)
    axes.set_ylim(0.5 - len(part.lanes), 0.5)
    axes.grid(visible=False, axis="y")
    _name_axis(axes.xaxis, part.across)
    meant = {words: _colour(name) for words, name in part.colours.items()}
    return {word: Patch(color=colour) for word, colour in {**colours, **meant}.items()}


_LOOKS: Final[dict[str, tuple[str, float]]] = {
    "thing": ("rest", 1.0),
    "low": ("rest", 0.5),
    "target": ("bad", 1.0),
    "goal": ("good", 1.0),
    "body": ("blue", 1.0),
    "ghost": ("blue", 0.3),
    "nose": ("paper", 1.0),
    "path": ("colour0", 1.0),
    "ray": ("quiet", 0.15),
    "echo": ("doubtful", 0.35),
}
"""Colour and opacity of each look of a shape."""


def _shapes(part: Plane) -> list[Shape]:
    """Its shapes, and those of each body where it is with nothing known of it: at its own zero."""
    return [*part.shapes, *(each for body in part.bodies for each in body.shapes)]


def _draw_plane(axes: Axes, part: Plane) -> dict[str, Handle]:
    handles = {shape.name: _draw_shape(axes, shape) for shape in _shapes(part)}
    axes.autoscale_view()
    _name_axis(axes.xaxis, f"x, {part.unit}")
    _name_axis(axes.yaxis, f"y, {part.unit}")
    _set_ends(axes, part)
    _make_equal(axes, part)
    return handles


def _draw_shape(axes: Axes, shape: Shape) -> Handle:
    name, alpha = _LOOKS[shape.look]
    colour = _colour(shape.colour or name)
    if shape.form == "line":
        width = 4 if shape.look in {"thing", "low"} else 2
        (line,) = axes.plot(*zip(*shape.points, strict=True), color=colour, lw=width, alpha=alpha)
        return line
    look: dict[str, Any] = {"facecolor": colour, "alpha": alpha, "linewidth": 0}
    if shape.look == "goal":
        look = {"fill": False, "linestyle": "--", "edgecolor": colour}
    patch = _patch(shape, look)
    axes.add_patch(patch)
    return patch


def _patch(shape: Shape, look: dict[str, Any]) -> Patch:
    if shape.form == "circle":
        return Circle(shape.points[0], shape.radius, **look)
    if shape.form == "polygon":
        return Polygon(list(shape.points), **look)
    middle = shape.direction_rad
    sides = degrees(middle - shape.half_rad), degrees(middle + shape.half_rad)
    return Wedge(shape.points[0], shape.radius, *sides, **look)
