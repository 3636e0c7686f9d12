"""Pages, their elements and tables, built as a tree: text from a file stays text.

A page holds all it needs and asks nothing of the network: its content security policy says so.
Names of boards, paths of models and reasons come from files that are not trusted. They
are escaped where the tree is written out, in one place, and not where they are put in.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Final, TypeAlias
from xml.etree.ElementTree import Element, tostring

from firmware_runtime.statistics.number_formats import plain
from firmware_runtime.view.style import STYLE

Child: TypeAlias = "Element | str | None"

_POLICY: Final = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"
_ICON: Final = (
    "data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 8 8'%3E"
    "%3Cpath d='M0 8V3h2v5zm3 0V0h2v8zm3 0V5h2v3z' fill='%230969da'/%3E%3C/svg%3E"
)

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


def page_of(title: str, sections: Iterable[Element]) -> str:
    """The text of a self-contained page."""
    body = element("body", element("main", *sections))
    root = element("html", _head(title), body, lang="en")
    return f"<!DOCTYPE html>\n{tostring(root, encoding='unicode', method='html')}"


def _head(title: str) -> Element:
    policy = {"http-equiv": "Content-Security-Policy"}
    return element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", content=_POLICY, **policy),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", name="color-scheme", content="light dark"),
        element("title", title),
        element("link", rel="icon", href=_ICON),
        element("style", STYLE),
    )


def opening(title: str, *content: Child) -> Element:
    """The head of a page: its title, and what is to be read first."""
    return element("header", element("h1", title), *content)


def section(title: str, *content: Child) -> Element:
    """A part of a page under its heading."""
    return element("section", element("h2", title), *content)


def verdict_line(word: str, css: str, sentences: str) -> Element:
    """A verdict in a word, `good`, `doubtful`, `bad` or `open`, and what it says."""
    return element("p", element("strong", word, class_=f"verdict {css}"), " ", sentences)


def bullets(items: Iterable[Child]) -> Element:
    """A list."""
    return element("ul", *(element("li", each) for each in items))


def folded(summary: str, *content: Child) -> Element:
    """Hide content until its summary is clicked."""
    return element("details", element("summary", summary), *content)


def side_by_side(content: Iterable[Element]) -> Element:
    """Elements beside each other where the page is wide enough."""
    return element("div", *content, class_="pairs")


def table(
    caption: str,
    head: Sequence[str],
    rows: Iterable[Sequence[Child]],
    css: str = "numbers",
    otherwise: str = "",
) -> Element:
    """A table whose first column names the row; it scrolls where the page is narrow.

    Without any row the sentence `otherwise`, if there is one.
    """
    rows = list(rows)
    if otherwise and not rows:
        return element("p", otherwise)
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


def facts(caption: str, values: Mapping[str, object]) -> Element:
    """A table of values by name, in words."""
    rows = [(name.replace("_", " "), plain(value)) for name, value in values.items()]
    return table(caption, ("what", "value"), rows, "words")


def chart(svg: Element, caption: str, legend: Element | None, *numbers: Element) -> Element:
    """A picture with what it shows said above it, and its numbers folded away below it."""
    return element(
        "figure",
        element("figcaption", caption),
        legend,
        element("div", svg, class_="frame"),
        folded("Numbers", *numbers) if numbers else None,
    )


def legend(entries: Iterable[tuple[str, str]], lead: str = "") -> Element:
    """Meaning of the colours: pairs of a class of the style sheet and words; a lead before them."""
    items = [
        element("li", element("span", class_=f"swatch {css}", aria_hidden="true"), words)
        for css, words in entries
    ]
    before = element("li", lead, class_="quiet") if lead else None
    return element("ul", before, *items, class_="legend")


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
