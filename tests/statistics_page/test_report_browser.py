"""The page in a browser: silent, alone, in both colour schemes, at any width."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.shared import chromium
from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.view.page import page_of
from firmware_runtime.view.palette import PALETTE
from firmware_runtime.view.report.report import report

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.FOUND is None, reason="needs the Debian package chromium"),
]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[chromium.Page]:
    with chromium.open_page(tmp_path_factory.mktemp("chromium")) as opened:
        yield opened


def written(statistics: Statistics, directory: Path) -> Path:
    path = directory / "report.html"
    path.write_text(page_of(report(statistics, "headline")), encoding="utf-8")
    return path


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_is_silent_and_asks_for_nothing_but_itself(
    page: chromium.Page, any_run: Statistics, tmp_path: Path, scheme: str
) -> None:
    path = written(any_run, tmp_path)
    page.open(path, scheme)
    assert page.complaints == []
    assert page.requests == [path.as_uri()]


@pytest.mark.parametrize(("scheme", "side"), [("light", 0), ("dark", 1)])
def test_the_page_follows_the_reader_s_colour_scheme(
    page: chromium.Page, uneven: Statistics, tmp_path: Path, scheme: str, side: int
) -> None:
    page.open(written(uneven, tmp_path), scheme)
    for name, shown in (("paper", "backgroundColor"), ("ink", "color")):
        red, green, blue = (int(PALETTE[name][side][at : at + 2], 16) for at in (1, 3, 5))
        style = f"getComputedStyle(document.body).{shown}"
        assert page.evaluate(style) == f"rgb({red}, {green}, {blue})"


def test_a_printed_page_is_light(page: chromium.Page, uneven: Statistics, tmp_path: Path) -> None:
    page.open(written(uneven, tmp_path), "dark")
    dark = {"name": "prefers-color-scheme", "value": "dark"}
    page.ask("Emulation.setEmulatedMedia", media="print", features=[dark])
    paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
    page.ask("Emulation.setEmulatedMedia", media="screen")
    assert paper == "rgb(255, 255, 255)"


@pytest.mark.parametrize("width", [320, 380, 800, 1600])
def test_the_page_never_scrolls_sideways(
    page: chromium.Page, any_run: Statistics, tmp_path: Path, width: int
) -> None:
    page.open(written(any_run, tmp_path), "light", width)
    unfold = "for (const each of document.querySelectorAll('details')) each.open = true"
    page.evaluate(unfold)
    page.wait_until_no_wider(width)


def test_plots_are_named_for_those_who_cannot_see_them(
    page: chromium.Page, uneven: Statistics, tmp_path: Path
) -> None:
    page.open(written(uneven, tmp_path), "light")
    nodes = page.ask("Accessibility.getFullAXTree")["nodes"]
    groups = {each["name"]["value"] for each in nodes if each["role"]["value"] == "group"}
    named = "[...document.querySelectorAll('.plot')].map((each) => each.ariaLabel)"
    plots = page.evaluate(named)
    assert len(plots) > 3
    assert set(plots) <= groups
    assert all("sample" in each or "span" in each for each in plots)


def test_the_browser_would_have_noticed(page: chromium.Page, tmp_path: Path) -> None:
    path = tmp_path / "noisy.html"
    path.write_text(
        "<script>console.warn('loud')</script><img src='elsewhere.png'><script>nothing()</script>"
    )
    page.open(path, "light")
    assert len(page.complaints) >= 3
    assert page.requests == [path.as_uri(), (tmp_path / "elsewhere.png").as_uri()]
