"""A plot of a few curves over time as one SVG file: it stands alone, and in a page.

Lengths are pixels, y grows downwards. Colours are those of the project's pages, for light and dark.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, log10
from typing import Final
from xml.etree.ElementTree import Element, tostring

from firmware_runtime.view.markup import element
from firmware_runtime.view.style import PALETTE

Points = Sequence[tuple[float, float]]

WIDTH, HEIGHT = 720.0, 320.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 64.0, 16.0, 34.0, 44.0
_LETTER, _BETWEEN, _ROW = 7.6, 30.0, 18.0
"""Of a legend: a letter's width, a line with the room beside it, and from one row to the next."""
_LABEL_AT = 4.0
_MARKS = 6
_APART = 40.0
"""Pixels from one mark to the next, at least."""
_MOST_POINTS = 2000
_LARGEST = 1.35
"""A page shows a plot so many times its own size at most."""
_LINE: Final = 1.6
COLOURS: Final = ("blue", "late", "colour1", "colour4", "colour2")
_GREY: Final = ("line", "ink", "quiet")


@dataclass(frozen=True, slots=True)
class Curve:
    """Points in order of time, s; `is_dashed` for a reference."""

    name: str
    points: Points
    is_dashed: bool = False


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of time that is shaded, with a word or two at its top."""

    from_s: float
    until_s: float
    name: str = ""


Ends = tuple[float, float]


@dataclass(frozen=True, slots=True)
class LinePlot:
    """Curves on common axes, with a legend above."""

    title: str
    across: str
    up: str
    curves: Sequence[Curve]
    spans: Sequence[Span] = ()
    across_ends: Ends | None = None
    """The least and greatest that the axis shows; None: what the curves have."""
    up_ends: Ends | None = None
    width: float = WIDTH
    height: float = HEIGHT
    has_equal_scales: bool = False
    """Whether a unit is as long across as it is up, as on a map."""
    is_nested: bool = False
    """Whether each curve is thinner than the one before, so that equal ones can all be seen."""

    @property
    def reach(self) -> tuple[Ends, Ends]:
        """What its axes show: across, and up."""
        points = [point for curve in self.curves for point in curve.points] or [(0.0, 0.0)]
        across = self.across_ends or _ends([at for at, _ in points])
        return across, self.up_ends or _ends([value for _, value in points])

    def svg(self) -> Element:
        """The picture."""
        rows = _legend_rows(self.curves, self.up, self.width)
        top = _TOP + _ROW * (len(rows) - 1)
        across, up = self._ends(top)
        x = _Axis(*across, _LEFT, self.width - _RIGHT)
        y = _Axis(*up, self.height - _BOTTOM, top)
        return element(
            "svg",
            element("title", self.title),
            element("style", _STYLE),
            element("rect", class_="lp-paper", width="100%", height="100%"),
            *(each for span in self.spans for each in _span(span, x, y)),
            *_grid(x, y, self.across, self.up),
            *(self._curve(number, x, y) for number in range(len(self.curves))),
            *_legend(self.curves, rows, self.width),
            class_="lp",
            xmlns="http://www.w3.org/2000/svg",
            viewBox=f"0 0 {self.width:g} {self.height:g}",
            width="100%",
            style=f"max-width: {_LARGEST * self.width:g}px",
            role="img",
            aria_label=self.title,
        )

    def _ends(self, top: float) -> tuple[Ends, Ends]:
        """Where the axes end; with equal scales the shorter one shows more on both sides."""
        across, up = self.reach
        if not self.has_equal_scales:
            return across, up
        wide, high = self.width - _LEFT - _RIGHT, self.height - _BOTTOM - top
        unit = max((across[1] - across[0]) / wide, (up[1] - up[0]) / high)
        return _around(across, unit * wide), _around(up, unit * high)

    def text(self) -> str:
        """The file."""
        return tostring(self.svg(), encoding="unicode") + "\n"

    def _curve(self, number: int, x: "_Axis", y: "_Axis") -> Element:
        curve, rest = self.curves[number], self.curves[number + 1 :]
        thinner = sum(not each.is_dashed for each in rest)
        places = (f"{x.pixel(at):.1f},{y.pixel(value):.1f}" for at, value in _thinned(curve.points))
        return element(
            "polyline",
            element("title", curve.name),
            class_=_css(number, curve),
            points=" ".join(places),
            stroke_width=_LINE + thinner if self.is_nested and not curve.is_dashed else None,
        )


def on_common_axes(plots: Mapping[str, LinePlot]) -> dict[str, LinePlot]:
    """The plots with one axis for each quantity: equal labels, equal ends."""
    across: dict[str, Ends] = {}
    up: dict[str, Ends] = {}
    for plot in plots.values():
        for label, ends, found in zip(
            (plot.across, plot.up), plot.reach, (across, up), strict=True
        ):
            low, high = found.get(label, ends)
            found[label] = min(low, ends[0]), max(high, ends[1])
    return {
        name: replace(plot, across_ends=across[plot.across], up_ends=up[plot.up])
        for name, plot in plots.items()
    }


class _Axis:
    """From a value to pixels, with marks at round values."""

    def __init__(self, low: float, high: float, begin: float, end: float) -> None:
        self.low, self.high, self.begin, self.end = low, high, begin, end
        rough = (high - low) / max(2.0, min(_MARKS, abs(end - begin) / _APART))
        power = 10.0 ** floor(log10(rough))
        self._step = next(power * each for each in (1, 2, 5, 10) if power * each >= rough * 0.999)

    def pixel(self, value: float) -> float:
        share = (value - self.low) / (self.high - self.low)
        return self.begin + share * (self.end - self.begin)

    def marks(self) -> list[float]:
        first, last = ceil(self.low / self._step - 1e-9), floor(self.high / self._step + 1e-9)
        return [number * self._step for number in range(first, last + 1)]


def _around(ends: Ends, length: float) -> Ends:
    """An axis of this length about the middle of another."""
    middle = (ends[0] + ends[1]) / 2
    return middle - length / 2, middle + length / 2


def _ends(values: Sequence[float]) -> tuple[float, float]:
    """The least and greatest, apart."""
    low, high = min(values), max(values)
    room = 0.04 * (high - low) or max(abs(low), 1.0) * 0.5
    return (low - room if low < 0 or low > room else min(low, 0.0)), high + room


def _grid(x: _Axis, y: _Axis, across: str, up: str) -> list[Element]:
    lines = []
    for mark in x.marks():
        at = x.pixel(mark)
        lines.append(element("line", class_="lp-grid", x1=at, x2=at, y1=y.begin, y2=y.end))
        lines.append(_text(at, y.begin + 16, f"{mark:.6g}", "lp-mark", "middle"))
    for mark in y.marks():
        at = y.pixel(mark)
        lines.append(element("line", class_="lp-grid", x1=x.begin, x2=x.end, y1=at, y2=at))
        lines.append(_text(x.begin - 7, at + 4, f"{mark:.6g}", "lp-mark", "end"))
    lines.append(_text((x.begin + x.end) / 2, y.begin + 36, across, "lp-mark", "middle"))
    lines.append(_text(_LABEL_AT, _TOP - 20, up, "lp-mark", "start"))
    return lines


def _span(span: Span, x: _Axis, y: _Axis) -> list[Element]:
    """A shaded stretch, cut off where the axis ends."""
    begin, end = (max(x.low, min(x.high, at)) for at in (span.from_s, span.until_s))
    left, right = x.pixel(begin), x.pixel(end)
    shade = element(
        "rect",
        element("title", f"{span.name} {span.from_s:.2f} to {span.until_s:.2f}".strip()),
        class_="lp-span",
        x=left,
        y=y.end,
        width=right - left,
        height=y.begin - y.end,
    )
    return [shade, _text((left + right) / 2, y.end + 14, span.name, "lp-mark", "middle")]


def _css(number: int, curve: Curve) -> str:
    """The class of a curve's colour."""
    return "lp-dashed" if curve.is_dashed else f"lp-{COLOURS[number % len(COLOURS)]}"


def _thinned(points: Points) -> Iterator[tuple[float, float]]:
    """The least and the greatest of every so many points, so that no peak is lost."""
    every = -(-2 * len(points) // _MOST_POINTS)
    if every <= 2:
        yield from points
        return
    for begin in range(0, len(points), every):
        some = points[begin : begin + every]
        ends = (choose(some, key=lambda point: point[1]) for choose in (min, max))
        yield from sorted(dict.fromkeys(ends))


def _legend_rows(curves: Sequence[Curve], label: str, width: float) -> list[list[int]]:
    """Numbers of the curves that are named in each row: one row, or several below the label."""
    room = width - _RIGHT - _LABEL_AT
    lengths = [_LETTER * len(curve.name) + _BETWEEN for curve in curves]
    if sum(lengths) + _LETTER * len(label) <= room:
        return [list(range(len(curves)))]
    rows: list[list[int]] = [[], []]
    for number, length in enumerate(lengths):
        if rows[-1] and sum(lengths[each] for each in rows[-1]) + length > room:
            rows.append([])
        rows[-1].append(number)
    return rows


def _legend(curves: Sequence[Curve], rows: Sequence[Sequence[int]], width: float) -> list[Element]:
    found = []
    for row, numbers in enumerate(rows):
        at, y = width - _RIGHT, 18 + _ROW * row
        for number in reversed(numbers):
            curve = curves[number]
            at -= _LETTER * len(curve.name)
            found.append(
                element(
                    "line", class_=_css(number, curve), x1=at - 22, x2=at - 4, y1=y - 4, y2=y - 4
                )
            )
            found.append(_text(at, y, curve.name, "lp-name", "start"))
            at -= _BETWEEN
    return found


def _text(x: float, y: float, text: str, css: str, anchor: str) -> Element:
    return element("text", text, class_=css, x=x, y=y, text_anchor=anchor)


def _style() -> str:
    sides: list[str] = []
    for side in (0, 1):
        names = (*COLOURS, *_GREY, "paper")
        paint = {name: PALETTE[name][side] for name in names}
        rules = [f".lp-{name} {{ stroke: {paint[name]} }}" for name in COLOURS]
        rules += [
            f".lp-paper {{ fill: {paint['paper']} }}",
            f".lp-grid {{ stroke: {paint['line']} }}",
            f".lp-span {{ fill: {paint['late']} }}",
            f".lp-dashed {{ stroke: {paint['quiet']} }}",
            f".lp-mark {{ fill: {paint['quiet']} }} .lp-name {{ fill: {paint['ink']} }}",
        ]
        sides.append(" ".join(rules))
    shapes = (
        f".lp {{ stroke-width: {_LINE} }} .lp polyline, .lp line {{ fill: none }} "
        ".lp .lp-grid { stroke-width: 1 } "
        ".lp-dashed { stroke-dasharray: 5 4 } .lp-span { fill-opacity: .18 } "
        '.lp-mark, .lp-name { font: 12px "DejaVu Sans", Verdana, system-ui, sans-serif }'
    )
    return f"{shapes} {sides[0]} @media (prefers-color-scheme: dark) {{ {sides[1]} }}"


_STYLE: Final = _style()
