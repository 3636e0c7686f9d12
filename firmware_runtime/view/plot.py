"""A chart as inline SVG that is as wide as the page, with letters that keep their size.

Across, places are shares of the width and go into the SVG as percentages, so nothing is stretched
and no script is needed; down, they are pixels. Colours are in the page's style sheet alone.
"""

from xml.etree.ElementTree import Element

from firmware_runtime.view.markup import Child, element
from firmware_runtime.view.scales import Scale

_GAP = 8
"""Between the plot and the marks at its left, in pixels."""
_MARKS_BELOW = 18


class Plot:
    """An area `height` pixels high, with `above` pixels over it and `below` under it.

    Shapes come out in the order in which they are put in.
    """

    def __init__(self, height: float, *, above: float = 0, below: float = 0) -> None:
        self.top = above
        self.bottom = above + height
        self._height = height
        self._whole = self.bottom + below
        self._shapes: list[Element] = []

    def down(self, share: float) -> float:
        """Return the pixels down at a share of the way up the vertical axis."""
        return self.bottom - share * self._height

    def box(
        self, across: tuple[float, float], down: tuple[float, float], css: str, tooltip: str = ""
    ) -> None:
        """A rectangle, from left to right and from top to bottom."""
        (left, right), (top, bottom) = across, down
        self._put(
            "rect",
            element("title", tooltip) if tooltip else None,
            class_=css,
            x=_percent(left),
            width=_percent(right - left),
            y=top,
            height=bottom - top,
        )

    def line(self, start: tuple[float, float], end: tuple[float, float], css: str) -> None:
        """A straight line between two places: share across, pixels down."""
        (x1, y1), (x2, y2) = start, end
        self._put("line", class_=css, x1=_percent(x1), y1=y1, x2=_percent(x2), y2=y2)

    def text(self, across: float, down: float, text: str, css: str, *, right: bool = True) -> None:
        """Letters that begin a little right of a place, or end a little left of it."""
        side, anchor = (4, "start") if right else (-4, "end")
        x = _percent(across)
        self._put("text", text, class_=css, x=x, dx=side, y=down, text_anchor=anchor)

    def beside(self, down: float, text: str) -> None:
        """Letters left of the plot."""
        self._put("text", text, class_="mark", x=-_GAP, y=down + 4, text_anchor="end")

    def axes(self, across: Scale, up: Scale) -> None:
        """Grid and marks; to be put in first."""
        self._whole += _MARKS_BELOW + _GAP
        for tick in up.ticks:
            down = self.down(tick.place)
            self.line((0, down), (1, down), "grid")
            self.beside(down, tick.text)
        base = self._whole - _GAP
        for tick in across.ticks:
            self.line((tick.place, self.top), (tick.place, self.bottom + 4), "grid")
            anchor = "end" if tick.place > 0.98 else "middle"  # what is right of the plot is cut
            place = _percent(tick.place)
            self._put("text", tick.text, class_="mark", x=place, y=base, text_anchor=anchor)

    def svg(self, name: str, title: str, description: str) -> Element:
        """The picture, with a text for screen readers; `name` makes its identifiers unique."""
        return element(
            "svg",
            element("title", title, id=f"{name}-title"),
            element("desc", description, id=f"{name}-text"),
            *self._shapes,
            class_="plot",
            role="img",
            aria_labelledby=f"{name}-title {name}-text",
            width="100%",
            height=self._whole,
        )

    def _put(self, tag: str, *children: Child, **attributes: str | float) -> None:
        self._shapes.append(element(tag, *children, **attributes))


def _percent(share: float) -> str:
    return f"{share * 100:.3f}".rstrip("0").rstrip(".") + "%"
