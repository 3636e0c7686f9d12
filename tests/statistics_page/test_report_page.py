"""The page as text: whole, safe, in words too, and the same for the same statistics."""

import re
from collections import Counter
from html.parser import HTMLParser

import pytest

from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.view.report.report import page

HEADLINE = "100 Hz, and the rest of the line"
VOID = {"meta", "link"}


class Outline(HTMLParser):
    """Tags as they open and close, attributes, and the text outside style."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.opened: list[str] = []
        self.tags: Counter[str] = Counter()
        self.attributes: list[tuple[str, str, str]] = []
        self.words = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags[tag] += 1
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        if tag not in VOID:
            self.opened.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.opened.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.opened and self.opened[-1] != "style":
            self.words += data

    def values(self, name: str) -> list[str]:
        return [value for _, found, value in self.attributes if found == name]


def test_every_run_has_a_page_with_all_sections(any_run: Statistics) -> None:
    outline = Outline(page(any_run, HEADLINE))
    assert outline.opened == []
    assert outline.tags["h1"] == 1
    assert outline.tags["h2"] == 9
    assert HEADLINE in outline.words
    assert "nan" not in outline.words


def test_equal_statistics_make_equal_bytes(any_run: Statistics) -> None:
    assert page(any_run, HEADLINE).encode() == page(any_run, HEADLINE).encode()


def test_a_page_names_nothing_outside_itself(any_run: Statistics) -> None:
    outline = Outline(page(any_run, HEADLINE))
    for tag, name, value in outline.attributes:
        if name in {"src", "href", "data", "action", "srcset"}:
            assert (tag, value[:5]) == ("link", "data:")
    assert not {"script", "img", "iframe", "object"} & outline.tags.keys()
    assert "@import" not in page(any_run, HEADLINE)
    assert "url(" not in page(any_run, HEADLINE)


def test_identifiers_are_used_once_and_every_picture_names_its_own(any_run: Statistics) -> None:
    outline = Outline(page(any_run, HEADLINE))
    identifiers = outline.values("id")
    assert len(set(identifiers)) == len(identifiers)
    named = [each for value in outline.values("aria-labelledby") for each in value.split()]
    assert sorted(named) == sorted(identifiers)
    assert len(named) == 2 * outline.tags["svg"]


def test_what_an_enemy_wrote_stays_text(hostile: Statistics) -> None:
    outline = Outline(page(hostile, "<img src=x>"))
    assert "<script>alert(1)</script>\ufffd\ufffd &amp; \"'" in outline.words
    assert "<img src=x>" in outline.words
    assert outline.tags["script"] == outline.tags["img"] == 0


def test_a_page_can_be_written_as_utf_8(any_run: Statistics) -> None:
    text = page(any_run, HEADLINE).encode().decode()
    assert not re.search("[\x00-\x08\x0b-\x1f]", text)


@pytest.mark.parametrize(
    "said",
    [
        "imu at 5.700 s 500.00 ms late, step 300.0 µs",
        "steps before 50.00 ms",
        "waking 450.00 ms",
        "garbage 70.0 µs",
        "i2c1 0x68 592.5 µs",
        "kernel and accounting 10.0 µs",
        "Not granted: fifo_priority = 60. Operation not permitted. It takes CAP_SYS_NICE.",
        "imu.sample -> thrust",
        "99.75 % of 2,004 activations ran on time: 1 late, 4 skipped, in 1 episode.",
    ],
)
def test_the_page_says(uneven: Statistics, said: str) -> None:
    assert said in Outline(page(uneven, HEADLINE)).words


def test_what_was_not_requested_is_not_called_refused(uneven: Statistics) -> None:
    assert "Not granted: spin_us" not in Outline(page(uneven, HEADLINE)).words
