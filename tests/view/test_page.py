"""A page of data: text stays text, and nothing but its own scripts can run in it."""

import json
import re
from base64 import b64encode
from hashlib import sha256
from html.parser import HTMLParser

from firmware_runtime.view.page import page_of
from firmware_runtime.view.parts import Page, Part, Series, Table, Text, curve, section

HOSTILE = "</script><script>alert(1)</script><!-- <b> & \x00 \ud800"


class _Scripts(HTMLParser):
    """The scripts of a page, and its data."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.scripts: list[str] = []
        self.data = ""
        self._kind: str | None = None
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "script":
            self._kind = dict(attrs).get("type") or "code"

    def handle_data(self, data: str) -> None:
        if self._kind == "code":
            self.scripts.append(data)
        elif self._kind is not None:
            self.data += data

    def handle_endtag(self, tag: str) -> None:
        if tag == "script":
            self._kind = None


def _page(text: str) -> str:
    parts: list[Part] = [
        section(text, Text(text=text), Table(title=text, head=[text], rows=[[text]])),
        Series(title=text, across="s", up=text, curves=[curve(text, [(0.0, float("nan"))])]),
    ]
    return page_of(Page(title=text, parts=parts))


def test_what_a_robot_says_becomes_no_markup() -> None:
    plain, hostile = _Scripts(_page("words")), _Scripts(_page(HOSTILE))
    assert hostile.scripts == plain.scripts
    assert json.loads(hostile.data)["page"]["parts"][0]["parts"][0]["text"].startswith("</script>")
    assert _page(HOSTILE).encode()


def test_only_the_scripts_of_the_page_may_run() -> None:
    text = _page("words")
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    assert policy is not None
    directives = dict(each.strip().partition(" ")[::2] for each in policy[1].split(";"))
    digests = (sha256(each.encode()).digest() for each in _Scripts(text).scripts)
    expected = {b64encode(each).decode() for each in digests}
    assert set(re.findall(r"'sha256-([^']*)'", directives["script-src"])) == expected
    assert directives["default-src"] == directives["connect-src"] == "'none'"


def test_what_is_no_number_leaves_a_gap() -> None:
    data = json.loads(_Scripts(_page("words")).data)
    assert data["page"]["parts"][1]["curves"][0]["y"] == [None]


def test_equal_data_make_equal_pages() -> None:
    assert _page("words") == _page("words")
