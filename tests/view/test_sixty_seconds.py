"""What a stranger does in a minute: sees a robot move, breaks a chip, sees it named, rewinds."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from benchmarks.shared import chromium
from benchmarks.shared.page import served

pytestmark = [
    pytest.mark.slow,
    pytest.mark.real_time,
    pytest.mark.skipif(chromium.FOUND is None, reason="needs the Debian package chromium"),
]
_TRIES, _WITHIN_S = 7, 20.0
_SEEN_AT = "parseFloat(document.querySelector('output.at').textContent)"
_GO_BEFORE = """(() => {
    const all = [...document.querySelectorAll('#faults li')];
    const button = all.find((each) => each.textContent.includes('DEVICE')).querySelector('button');
    button.click();
    return parseFloat(button.textContent);
})()"""
_ARMED = """document.getElementById('badge').textContent === 'armed' || ([
    ...document.querySelectorAll('header button')
].find((each) => each.textContent === 'Arm').click(), false)"""
"""A guard may have taken over on a machine that was too busy for the doubles: once more, then."""
_OVER = "!['armed', 'disarmed'].includes(document.getElementById('badge').textContent)"
"""It died; or had ended by itself, for want of what was broken."""
_FAULTS = "document.getElementById('faults').textContent"


@contextmanager
def armed(board: str, page: chromium.Page) -> Iterator[None]:
    """A robot that is played with and armed, on its page; a busy machine may need some tries."""
    for _ in range(_TRIES):
        with served("play", board, stderr=subprocess.DEVNULL) as play:
            page.open(f"{play.address}/", "light")
            page.wait_for("document.body.dataset.ready")
            is_armed = page.comes_true(_ARMED, timeout_s=_WITHIN_S)
            if is_armed:
                yield
        assert play.process.returncode == 0
        if is_armed:
            return
    raise AssertionError(f"{board} was never armed")


@pytest.mark.parametrize(
    ("board", "device", "kind"),
    [
        ("tachobot", "imu", "absent"),
        ("detective", "body_compass", "absent"),
        ("pan_tilt", "eyes", "absent"),
    ],
)
def test_a_stranger_sees_breaks_and_rewinds_a_robot(
    board: str, device: str, kind: str, tmp_path: Path
) -> None:
    with chromium.open_page(tmp_path / "chromium") as page, armed(board, page):
        page.wait_for("Object.keys(store.values).length > 2")
        choose = "document.querySelector('select[aria-label=device]')"
        page.wait_for(choose)  # it comes with an answer of the doubles
        page.evaluate(f"{choose}.value = {device!r}")
        page.evaluate(f"{choose}.dispatchEvent(new Event('change'))")
        page.evaluate("document.querySelector('select[aria-label=\"for how long\"]').value = ''")
        page.click(kind, "#break")
        page.wait_for(f"{_FAULTS}.includes({device!r})")
        page.wait_for(f"document.querySelector('.struck').textContent.includes('{kind} {device}')")
        fault_at = page.evaluate(_GO_BEFORE.replace("DEVICE", device))
        page.wait_for("document.querySelectorAll('.events li').length > 0")
        before = page.evaluate(_SEEN_AT)
        assert before <= fault_at
        page.click("step forward")
        page.wait_for(f"{_SEEN_AT} > {before}")
        page.click("Now")
        page.wait_for("!rewind.isAway")
        page.click("Kill the run", "#break")
        page.wait_for(_OVER)
