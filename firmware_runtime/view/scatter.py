"""Pictures of a sweep: a histogram of a figure, and a figure over a key that was varied."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final
from xml.etree.ElementTree import Element

from firmware_runtime.view.line_plot import Curve, LinePlot
from firmware_runtime.view.markup import element

WIDTH, HEIGHT = 340.0, 220.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 56.0, 12.0, 12.0, 40.0
_DOT: Final = 1.8
_LARGEST: Final = 1.35
"""Times as large as drawn, at most: two stand side by side, and their words are the page's size."""


def histogram(name: str, counts: Sequence[int], lowest: float, highest: float) -> LinePlot:
    """Histogram as a line around its bars: `counts` in equal parts from lowest to highest."""
    wide = (highest - lowest) / len(counts) or abs(lowest) or 1.0
    points = [(lowest, 0.0)]
    for index, rows in enumerate(counts):
        begin = lowest + index * wide
        points += [(begin, float(rows)), (begin + wide, float(rows))]
    points.append((lowest + len(counts) * wide, 0.0))
    ends = (points[0][0], points[-1][0])
    return LinePlot(
        title=name, across=name, up="runs", curves=[Curve(name, points)], across_ends=ends
    )


@dataclass(frozen=True, slots=True)
class Scatter:
    """A dot a row: a figure over a key; `marked` dots are runs with a truth that is rarely so."""

    across: str
    up: str
    points: Sequence[tuple[float, float, bool]]

    def svg(self) -> Element:
        """The picture; its colours are the page's."""
        x = _scale([point[0] for point in self.points], _LEFT, WIDTH - _RIGHT)
        y = _scale([point[1] for point in self.points], HEIGHT - _BOTTOM, _TOP)
        title = f"{self.up} over {self.across}"
        return element(
            "svg",
            element("title", title),
            *self._frame(),
            *(self._dot(x(across), y(up), is_marked) for across, up, is_marked in self.points),
            xmlns="http://www.w3.org/2000/svg",
            viewBox=f"0 0 {WIDTH:g} {HEIGHT:g}",
            width="100%",
            style=f"max-width: {_LARGEST * WIDTH:g}px",
            role="img",
            aria_label=title,
        )

    def _frame(self) -> list[Element]:
        across, up = ([point[axis] for point in self.points] for axis in (0, 1))
        bottom, right = HEIGHT - _BOTTOM, WIDTH - _RIGHT
        lines = [
            element("line", x1=_LEFT, x2=right, y1=bottom, y2=bottom, stroke="currentColor"),
            element("line", x1=_LEFT, x2=_LEFT, y1=_TOP, y2=bottom, stroke="currentColor"),
        ]
        texts = [
            (_LEFT, bottom + 14, f"{min(across):.4g}", "start"),
            (right, bottom + 14, f"{max(across):.4g}", "end"),
            ((_LEFT + right) / 2, HEIGHT - 8, self.across, "middle"),
            (_LEFT - 4, bottom, f"{min(up):.3g}", "end"),
            (_LEFT - 4, _TOP + 8, f"{max(up):.3g}", "end"),
        ]
        return lines + [
            element(
                "text", text, x=left, y=top, text_anchor=anchor, font_size="11", fill="currentColor"
            )
            for left, top, text, anchor in texts
        ]

    def _dot(self, x: float, y: float, is_marked: bool) -> Element:  # noqa: FBT001 -- a point's
        colour = "#cf222e" if is_marked else "#0969da"
        return element("circle", cx=x, cy=y, r=_DOT, fill=colour, fill_opacity="0.5")


def _scale(values: Sequence[float], begin: float, end: float) -> Callable[[float], float]:
    """From a value to pixels."""
    low, high = min(values), max(values)
    span = high - low or 1.0
    return lambda value: begin + (value - low) / span * (end - begin)
