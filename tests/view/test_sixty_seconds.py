"""What a stranger does in a minute: sees a robot move, breaks a chip, sees it named, rewinds."""

import re
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from signal import SIGINT

import pytest

from benchmarks.shared import chromium
from firmware_runtime.system.programs import end_within
from tests.support.command import started
from tests.support.waiting import PATIENCE_S

pytestmark = [
    pytest.mark.slow,
    pytest.mark.real_time,
    pytest.mark.skipif(chromium.FOUND is None, reason="needs the Debian package chromium"),
]
_TRIES, _WITHIN_S = 4, 20.0
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
def played(board: str) -> Iterator[str]:
    """`play`, until the block ends; yields the page's address."""
    process = started("play", board, "--no-browser", "--port", 0, stderr=subprocess.DEVNULL)
    try:
        assert process.stdout is not None
        for line in process.stdout:
            if found := re.search(r"http://[^/\s]+", line):
                yield found[0]
                break
        else:
            raise AssertionError("play has ended")
    finally:
        process.send_signal(SIGINT)
        end_within(process, PATIENCE_S)
        if process.stdout is not None:
            process.stdout.close()
    assert process.returncode == 0


@contextmanager
def armed(board: str, page: chromium.Page) -> Iterator[None]:
    """A robot that is played with and armed, on its page; a busy machine may need some tries."""
    for left in reversed(range(_TRIES)):
        with played(board) as address:
            page.open(f"{address}/", "light")
            page.wait_for("document.body.dataset.ready")
            if page.comes_true(_ARMED, timeout_s=_WITHIN_S) or not left:
                page.wait_for(_ARMED)
                yield
                return


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
