"""Parts of every kind on one page in a browser: all drawn, nothing complained of, at any width."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.shared import chromium
from firmware_runtime.view.page_file import write_page
from firmware_runtime.view.parts import (
    Bar,
    Bars,
    Beside,
    Bullets,
    Card,
    Code,
    Curve,
    Folded,
    Glossary,
    Link,
    Page,
    Part,
    Piece,
    Series,
    Text,
    Verdict,
    section,
    table,
)
from tests.view.test_page_file import KINDS

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.FOUND is None, reason="needs the Debian package chromium"),
]
PICTURES: list[Part] = [part for part, _ in KINDS.values()]
WORDS: list[Part] = [
    Bullets(items=["a", Link("b", "b.csv"), Code("c")]),
    Glossary(items=[("word", "meaning")]),
    table("numbers", ("name", "value"), [("x", "1")]),
    Bars(rows=[Bar("step", [[Piece("imu", 1.0, "1 us", "colour0")], []], "late", "why", 5)]),
    Folded(title="more", parts=[Text(text="hidden", look="warning")]),
]
PAGE = Page(
    title="All kinds",
    opening=[Verdict(judgement="good", word="done", sentences=["All of them."])],
    parts=[
        section("Words", *WORDS),
        section("Pictures", *PICTURES),
        section("Beside", Beside(parts=[Card(title=Link("one", "one.html"), parts=PICTURES[:1])])),
    ],
)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[chromium.Page]:
    with chromium.open_page(tmp_path_factory.mktemp("chromium")) as opened:
        yield opened


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [320, 1100])
def test_all_kinds_are_drawn_in_silence(
    browser: chromium.Page, tmp_path: Path, scheme: str, width: int
) -> None:
    write_page(PAGE, tmp_path / "page.html")
    browser.open(tmp_path / "page.html", scheme, width)
    assert browser.complaints == []
    figures = "[...document.querySelectorAll('figure')].filter((each) => each.querySelector("
    assert browser.evaluate(f"{figures}'canvas, svg')).length") == len(PICTURES) + 1
    browser.wait_until_no_wider(width)


def test_what_is_folded_is_made_when_it_is_opened(browser: chromium.Page, tmp_path: Path) -> None:
    write_page(PAGE, tmp_path / "page.html")
    browser.open(tmp_path / "page.html", "light")
    shown = "document.querySelector('details').textContent"
    assert "hidden" not in browser.evaluate(shown)
    browser.evaluate("document.querySelector('details').open = true")
    browser.wait_for(f"{shown}.includes('hidden')")


@pytest.mark.parametrize("period", [2, 500])
def test_a_line_that_fills_its_plot_is_drawn_as_bars(
    browser: chromium.Page, tmp_path: Path, period: int
) -> None:
    values = [float(n % period < period // 2) for n in range(4000)]
    dense = Series("dense", "s", "V", [Curve("x", list(range(4000)), values)])
    write_page(Page(title="Dense", parts=[dense]), tmp_path / "page.html")
    browser.open(tmp_path / "page.html", "light")
    plot = "[...groups.get('s')][0].library"
    drawn = browser.evaluate(f"{plot}.series[1].bars?.length ?? null")
    assert (drawn is not None) == (period == 2)
    inked = f"""(() => {{
        const plot = {plot}, x = plot.bbox.left + 0.53 * plot.bbox.width;
        const {{ data }} = plot.ctx.getImageData(x, plot.bbox.top, 1, plot.bbox.height);
        let inked = 0;
        for (let n = 0; n < data.length; n += 4) if (data[n + 3] > 200 && data[n] < 50) inked++;
        return inked / plot.bbox.height;
    }})()"""
    assert (browser.evaluate(inked) > 0.8) == (period == 2)
