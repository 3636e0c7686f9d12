"""The page: whole, safe, in words too, and the same for the same statistics."""

import json
import re

import msgspec
import pytest

from firmware_runtime.statistics.statistics import Statistics
from firmware_runtime.view.page import page_of
from firmware_runtime.view.report.report import report

HEADLINE = "100 Hz, and the rest of the line"


def written(statistics: Statistics, headline: str = HEADLINE) -> str:
    return page_of(report(statistics, headline))


def words(statistics: Statistics) -> str:
    page = msgspec.to_builtins(report(statistics, HEADLINE))
    return json.dumps(page, ensure_ascii=False)


def test_every_run_has_a_page_with_all_sections(any_run: Statistics) -> None:
    page = report(any_run, HEADLINE)
    assert len(page.parts) == 9
    assert HEADLINE in words(any_run)


def test_equal_statistics_make_equal_bytes(any_run: Statistics) -> None:
    assert written(any_run).encode() == written(any_run).encode()


def test_a_page_carries_its_data_whole(any_run: Statistics) -> None:
    (data,) = re.findall(
        '<script type="application/json" id="data">(.*?)</script>', written(any_run)
    )
    found = json.loads(data)["page"]
    sections = [each["title"] for each in found["parts"]]
    assert sections == [each.title for each in report(any_run, HEADLINE).parts]  # type: ignore[union-attr]


def test_what_an_enemy_wrote_stays_text(hostile: Statistics) -> None:
    text = written(hostile, "<img src=x>")
    head, data = text.split('<script type="application/json" id="data">')
    assert "<script>alert(1)" not in text
    assert "<img" not in text
    assert "&lt;/title&gt;&lt;script&gt;alert(1)" in head
    shown = json.loads(data.partition("</script>")[0])["page"]["opening"]
    assert shown[1]["text"] == "<img src=x>"


def test_a_page_can_be_written_as_utf_8(any_run: Statistics) -> None:
    head = written(any_run).partition('<script type="application/json"')[0].encode().decode()
    assert not re.search("[\x00-\x08\x0b-\x1f]", head)


@pytest.mark.parametrize(
    "said",
    [
        "imu at 5.700 s",
        "500.00 ms late, step 300.0 µs",
        "garbage",
        "i2c1 0x68",
        "kernel and accounting",
        "Not granted: fifo_priority = 60. Operation not permitted. It takes CAP_SYS_NICE.",
        "imu.sample -> thrust",
        "99.75 % of 2,004 activations ran on time: 1 late, 4 skipped, in 1 episode.",
    ],
)
def test_the_page_says(uneven: Statistics, said: str) -> None:
    assert said in words(uneven)


def test_what_was_not_requested_is_not_called_refused(uneven: Statistics) -> None:
    assert "Not granted: spin_us" not in words(uneven)
