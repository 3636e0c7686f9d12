"""A page as one HTML file, with its data and all that draws it; it asks nothing of any network.

The content security policy names the scripts by their digests, so no other can run, and nothing of
a robot becomes markup: its data are JSON, which the front end puts on the page as text.
"""

import json
import re
from base64 import b64encode
from collections.abc import Iterable, Mapping
from hashlib import sha256
from html import escape
from importlib.resources import files
from typing import Final

import msgspec

from firmware_runtime.view.palette import style_of_colours
from firmware_runtime.view.parts import Page

_STYLES: Final = ("vendor/uPlot.min.css", "style.css")
_DRAWING: Final = (
    "vendor/uPlot.iife.min.js",
    "elements.js",
    "plots.js",
    "bars.js",
    "plane.js",
    "diagram.js",
    "parts.js",
)
"""Scripts that draw parts, in the order in which they build on one another."""
_ICON: Final = (
    "data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 8 8'%3E"
    "%3Cpath d='M0 8V3h2v5zm3 0V0h2v8zm3 0V5h2v3z' fill='%230969da'/%3E%3C/svg%3E"
)
_UNSPEAKABLE: Final = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff]")
"""Characters that HTML or UTF-8 cannot carry; JSON can."""
_NO_SCRIPT: Final = "This page draws its data with the script that it holds; scripts are off here."


def page_of(page: Page) -> str:
    """The text of a self-contained page."""
    return html_of(page.title, {"page": msgspec.to_builtins(page)}, ("static.js",))


def html_of(
    title: str,
    data: Mapping[str, object],
    scripts: Iterable[str],
    connects_to: str = "'none'",
) -> str:
    """The text of a page that holds these data, and runs what draws and then these scripts.

    `connects_to` is the policy's source of what it may ask for: nothing, or its own server.
    """
    code = [front(name) for name in (*_DRAWING, *scripts)]
    digests = " ".join(f"'sha256-{_digest(each)}'" for each in code)
    policy = (
        f"default-src 'none'; script-src {digests}; style-src 'unsafe-inline'; "
        f"img-src data: blob:; connect-src {connects_to}; base-uri 'none'; form-action 'none'"
    )
    style = style_of_colours() + "".join(map(front, _STYLES))
    clean_title = escape(_UNSPEAKABLE.sub("\N{REPLACEMENT CHARACTER}", title))
    return "\n".join(
        (
            "<!DOCTYPE html>",
            '<html lang="en"><head><meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<meta name="color-scheme" content="light dark">',
            f"<title>{clean_title}</title>",
            f'<link rel="icon" href="{_ICON}">',
            f"<style>{style}</style></head><body>",
            f"<noscript>{_NO_SCRIPT}</noscript><main></main>",
            f'<script type="application/json" id="data">{_embedded(data)}</script>',
            *(f"<script>{each}</script>" for each in code),
            "</body></html>\n",
        )
    )


def front(name: str) -> str:
    """The text of a file of the front end."""
    return files(__package__).joinpath("front", *name.split("/")).read_text(encoding="utf-8")


def _embedded(data: Mapping[str, object]) -> str:
    """JSON that ends no script element, whatever is in it."""
    text = json.dumps(_finite(data), ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    for letter in "<>&":
        text = text.replace(letter, f"\\u{ord(letter):04x}")
    return text


def _finite(value: object) -> object:
    """Replace what JSON or a page cannot carry: numbers that are none by null."""
    match value:
        case float():
            return value if value - value == 0.0 else None
        case str():
            return _UNSPEAKABLE.sub("\N{REPLACEMENT CHARACTER}", value)
        case Mapping():
            return {_finite(key): _finite(each) for key, each in value.items()}
        case list() | tuple():
            return [_finite(each) for each in value]
    return value


def _digest(script: str) -> str:
    return b64encode(sha256(script.encode()).digest()).decode()
