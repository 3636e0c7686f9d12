"""The link of a run in its statistics: its cells, its figures, what two readings differ by."""

from firmware_runtime.links.cut.counts import Carried, Counts
from firmware_runtime.links.cut.refusal import Reason
from firmware_runtime.statistics.comparison import difference, merged
from firmware_runtime.statistics.file import StatisticsFile
from firmware_runtime.statistics.histogram import Histogram
from firmware_runtime.statistics.layout import LINK, Layout
from firmware_runtime.statistics.metrics import exposition
from firmware_runtime.statistics.rows import REFUSALS
from firmware_runtime.statistics.run_text import statistics_text

LAYOUT = Layout(has_link=True)


def file_of(layout: Layout) -> StatisticsFile:
    return StatisticsFile(layout, {"models": {}, "conditions": {}})


def test_reasons_are_the_fields_of_their_cells() -> None:
    assert tuple(Reason) == REFUSALS


def test_what_was_counted_is_read() -> None:
    file = file_of(LAYOUT)
    counts = Counts(
        sent=7,
        received=5,
        dropped=1,
        given_up=3,
        unconnected=4,
        carried=Carried({Reason.FORGED: 3}, dropped=1),
    )
    counts.own[Reason.FORGED] += 1
    row = counts.row(is_good=True, silences=2)
    before = file.statistics()
    for index, number in enumerate(row):
        file.cells[LAYOUT.link + index] = number
    Histogram(file.cells[LAYOUT.link_age]).record(1_500_000)
    assert len(row) == len(LINK)
    link = file.statistics().figures().link
    assert link is not None
    assert (link.is_good, link.sent, link.received, link.dropped, link.silences) == (
        True,
        7,
        5,
        2,
        2,
    )
    assert (link.given_up, link.unconnected) == (3, 4), "neither is a drop"
    assert link.refused == {**dict.fromkeys(REFUSALS, 0), "forged": 4}
    assert link.age_us.max == 1500
    assert link.round_trip_us.p50 is None
    since = difference(file.statistics(), before).figures().link
    twice = merged([file.statistics(), file.statistics()]).figures().link
    assert since is not None
    assert twice is not None
    assert (since.sent, twice.sent, twice.refused["forged"]) == (7, 14, 8)
    assert any(
        "silences; refused forged 4; dropped 2; given up 3; left while not connected 4" in line
        for line in statistics_text(file.statistics().figures())
    )


def test_prometheus_has_it() -> None:
    file = file_of(LAYOUT)
    counts = Counts(sent=7)
    counts.own[Reason.STALE] = 2
    for index, number in enumerate(counts.row(is_good=True, silences=0)):
        file.cells[LAYOUT.link + index] = number
    text = exposition("rover.controller", file.statistics())
    assert 'firmware_runtime_link_sent_total{board="rover.controller"} 7.0' in text
    assert 'reason="stale"} 2.0' in text
    assert "link" not in exposition("rover", file_of(Layout()).statistics())


def test_a_whole_robot_has_no_link() -> None:
    file = file_of(Layout())
    assert file.statistics().figures().link is None
    assert "link" not in file.statistics().as_json()
    assert not any("link:" in line for line in statistics_text(file.statistics().figures()))
