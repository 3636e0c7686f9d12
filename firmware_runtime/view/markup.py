"""Elements, tables and frames of a page, built as a tree: text from a file stays text.

Names of boards, paths of models and reasons come from files that are not trusted. They
are escaped where the tree is written out, in one place, and not where they are put in.
"""

import re
from collections.abc import Iterable, Sequence
from typing import Final, TypeAlias
from xml.etree.ElementTree import Element, tostring

Child: TypeAlias = "Element | str | None"

_UNSPEAKABLE: Final = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff]")
"""Characters that HTML or UTF-8 cannot carry; JSON can."""
_IN_A_LINE: Final = frozenset({"b", "code", "span", "strong"})


def element(tag: str, *children: Child, **attributes: str | float | None) -> Element:
    """One element: `class_` becomes `class`, `text_anchor` becomes `text-anchor`.

    Children and attributes that are None are left out.
    """
    made = Element(tag)
    for name, value in attributes.items():
        if value is not None:
            made.set(name.rstrip("_").replace("_", "-"), _clean(_text(value)))
    for child in children:
        _append(made, child)
    if tag not in _IN_A_LINE:
        made.tail = "\n"
    return made


def document(root: Element) -> str:
    """The text of the file."""
    return f"<!DOCTYPE html>\n{tostring(root, encoding='unicode', method='html')}"


def table(
    caption: str, head: Sequence[str], rows: Iterable[Sequence[Child]], css: str = "numbers"
) -> Element:
    """A table whose first column names the row; it scrolls where the page is narrow."""
    columns = [element("th", text, scope="col") for text in head]
    body = [
        element("tr", element("th", first, scope="row"), *(element("td", cell) for cell in cells))
        for first, *cells in rows
    ]
    rows_in_columns = element(
        "table",
        element("thead", element("tr", *columns)),
        element("tbody", *body),
        class_=css,
        aria_label=caption,
    )
    scrolling = element(
        "div", rows_in_columns, class_="scroll", role="region", aria_label=caption, tabindex=0
    )
    return element("div", element("p", caption, class_="caption"), scrolling)


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


def _append(parent: Element, child: Child) -> None:
    if isinstance(child, Element):
        parent.append(child)
    elif child is not None and len(parent) == 0:
        parent.text = (parent.text or "") + _clean(child)
    elif child is not None:
        parent[-1].tail = (parent[-1].tail or "") + _clean(child)


def _text(value: str | float) -> str:
    """A number with two decimals at most: a hundredth of a pixel is never seen."""
    return value if isinstance(value, str) else f"{value:.2f}".rstrip("0").rstrip(".")


def _clean(text: str) -> str:
    return _UNSPEAKABLE.sub("\N{REPLACEMENT CHARACTER}", text)
