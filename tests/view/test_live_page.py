"""The page of a run in a browser: what a stranger sees in a minute."""

import subprocess
from collections.abc import Iterator

import pytest

from benchmarks.shared import chromium
from tests.support.recorded import record
from tests.support.served_page import served_page

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium.FOUND is None, reason="needs the Debian package chromium"),
]
READY = "document.body.dataset.ready"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[chromium.Page]:
    with chromium.open_page(tmp_path_factory.mktemp("chromium")) as opened:
        yield opened


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    path = record(tmp_path_factory.mktemp("run") / "tachobot.recording", "tachobot", 2.0)
    with served_page(path, stderr=subprocess.DEVNULL) as page:
        yield page.address


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_complains_of_nothing_and_asks_only_its_server(
    browser: chromium.Page, address: str, scheme: str
) -> None:
    browser.open(f"{address}/", scheme)
    browser.wait_for(READY)
    assert all(each.startswith((address, "ws://", "data:")) for each in browser.requests)
    assert [each for each in browser.complaints if "404" not in each and "409" not in each] == []


@pytest.mark.parametrize("width", [320, 800, 1600])
def test_it_never_scrolls_sideways(browser: chromium.Page, address: str, width: int) -> None:
    browser.open(f"{address}/", "light", width)
    browser.wait_for(READY)
    browser.wait_until_no_wider(width)


def test_an_instant_of_a_recording_is_seen_and_stepped_through(
    browser: chromium.Page, address: str
) -> None:
    browser.open(f"{address}/", "light")
    browser.wait_for(READY)
    browser.evaluate("rewind.goTo(1.5e9)")
    at = "parseFloat(document.querySelector('output.at').textContent)"
    browser.wait_for(f"Math.abs({at} - 1.5) < 0.02")
    assert browser.evaluate("document.querySelectorAll('.events li').length") > 0
    cells = "[...document.querySelectorAll('.instant-seen td')].map(each => each.textContent)"
    assert "changed" in browser.evaluate(cells)
    before = browser.evaluate(at)
    browser.click("step forward")
    browser.wait_for(f"{at} > {before}")
    browser.click("step back")
    browser.wait_for(f"{at} === {before}")
    events = browser.evaluate("document.querySelectorAll('.events li').length")
    browser.click("event back")
    here = (
        "[...document.querySelectorAll('.events li')].findIndex(each => each.className === 'here')"
    )
    browser.wait_for(f"{here} === {events - 2}")


def test_a_port_is_plotted_when_it_is_clicked(browser: chromium.Page, address: str) -> None:
    browser.open(f"{address}/", "light")
    browser.wait_for(READY)
    before = browser.evaluate("document.querySelectorAll('.chosen figure').length")
    browser.click("controller.attitude.yaw")
    browser.wait_for(f"document.querySelectorAll('.chosen figure').length > {before}")
    browser.click("close controller.attitude.yaw.position")
    browser.wait_for("![...plots.shown.keys()].includes('controller.attitude.yaw.position')")


def test_no_peak_is_lost_of_many_points_nor_is_their_order(
    browser: chromium.Page, address: str
) -> None:
    browser.open(f"{address}/", "light")
    browser.wait_for(READY)
    found = browser.evaluate(
        """(() => {
            const at = (n) => n < 40000 ? n / 1000 : n / 100 - 360;
            const times = Array.from({ length: 50000 }, (_, n) => at(n));
            const values = times.map((_, n) => n === 12345 ? 9 : n === 45678 ? -9 : Math.sin(n));
            const [xs, ys] = visible([new Line(times, values)], 0, 140, 400, false);
            const isGrowing = xs.every((x, n) => n === 0 || x > xs[n - 1]);
            return [Math.max(...ys), Math.min(...ys), isGrowing, xs.length];
        })()"""
    )
    assert found[:3] == [9, -9, True]
    assert 400 <= found[3] <= 804


def test_what_is_sent_when_it_changes_is_drawn_up_to_now(
    browser: chromium.Page, address: str
) -> None:
    browser.open(f"{address}/", "light")
    browser.wait_for(READY)
    assert browser.evaluate("visible([new Line([1], [3])], 5, 9, 400, true)") == [[1, 9], [3, 3]]


def test_a_port_that_is_chosen_later_is_drawn_where_the_page_stands(
    browser: chromium.Page, address: str
) -> None:
    browser.open(f"{address}/", "light")
    browser.wait_for(READY)
    browser.evaluate("rewind.goTo(0.5e9)")
    browser.wait_for("plots.at < 0.6")
    browser.evaluate("plots.add('controller.attitude.yaw')")
    browser.evaluate("plots.element.scrollIntoView()")  # what is not seen is not drawn
    drawn = "plots.shown.get('controller.attitude.yaw.rate').plot.library.data[1].length"
    browser.wait_for(f"{drawn} > 20")


def test_a_page_that_is_printed_has_the_plots_that_are_not_on_the_screen(
    browser: chromium.Page, address: str
) -> None:
    browser.open(f"{address}/", "light")
    browser.wait_for(READY)
    line = "plots.store.lines.get('controller.allocation.forces.f2')"
    browser.wait_for(f"{line}?.times.length > 100 && plots.span()[1] > 1.9")
    plot = "[...plots.shown.values()].find((each) => !each.plot.isSeen)?.plot"
    browser.wait_for(f"{plot} !== undefined")
    drawn = f"{plot}.library.data[0].length"
    # On a busy machine some were drawn before the browser had said that it is not seen.
    browser.evaluate(f"{plot}.library.setData({plot}.library.data.map(() => []))")
    for _ in range(2):
        browser.evaluate("new Promise(requestAnimationFrame)")
    assert browser.evaluate(drawn) <= 2  # no frame of it is drawn
    printed = f"(dispatchEvent(new Event('beforeprint')), {drawn})"  # no frame comes between
    assert browser.evaluate(printed) > 20
    assert browser.evaluate(f"{plot} !== undefined")
