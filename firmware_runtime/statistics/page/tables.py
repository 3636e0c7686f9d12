"""Tables, and the frame that a chart shares with the table of its numbers."""

from collections.abc import Iterable, Sequence
from xml.etree.ElementTree import Element

from firmware_runtime.statistics.page.markup import Child, element


def table(
    caption: str, head: Sequence[str], rows: Iterable[Sequence[Child]], css: str = "numbers"
) -> Element:
    """A table whose first column names the row; it scrolls where the page is narrow."""
    columns = [element("th", text, scope="col") for text in head]
    body = [
        element("tr", element("th", first, scope="row"), *(element("td", cell) for cell in cells))
        for first, *cells in rows
    ]
    return element(
        "div",
        element("p", caption, class_="caption"),
        element(
            "div",
            element(
                "table",
                element("thead", element("tr", *columns)),
                element("tbody", *body),
                class_=css,
                aria_label=caption,
            ),
            class_="scroll",
            role="region",
            aria_label=caption,
            tabindex=0,
        ),
    )


def chart(svg: Element, caption: str, legend: Element | None, *numbers: Element) -> Element:
    """A picture with what it shows said above it, and its numbers folded away below it."""
    folded = element("details", element("summary", "Numbers"), *numbers) if numbers else None
    return element(
        "figure",
        element("figcaption", caption),
        legend,
        element("div", svg, class_="frame"),
        folded,
    )


def legend(*entries: tuple[str, str]) -> Element:
    """What the colours stand for: pairs of a class of the style sheet and words."""
    items = [
        element("li", element("span", class_=f"swatch {css}", aria_hidden="true"), words)
        for css, words in entries
    ]
    return element("ul", *items, class_="legend")
