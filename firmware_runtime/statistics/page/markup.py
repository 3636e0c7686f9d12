"""Elements of a page, built as a tree, so that text from a file can only ever become text.

Names of boards, paths of models and reasons come from files that anybody may have written. They
are escaped where the tree is written out, in one place, and not where they are put in.
"""

import re
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
