"""With and without are kept apart, the control is a control, and the reader really reads."""

import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import pytest

from benchmarks.reader.ratio import summary, sure
from benchmarks.reader.rounds import ALONE, ALONE_AGAIN, KINDS, READ, Round, reader
from benchmarks.shared.side_by_side import turned
from firmware_runtime.cli.main import main
from firmware_runtime.devs.time import MILLISECOND
from firmware_runtime.executive.clocks import VirtualClock
from firmware_runtime.executive.configuration import Configuration
from firmware_runtime.executive.executive import Executive
from firmware_runtime.statistics.histogram import CELLS, Histogram, empty_cells
from tests.support.periodic_models import Robot


def histogram(samples: Sequence[int]) -> Histogram:
    made = Histogram(empty_cells(CELLS))
    for sample in samples:
        made.record(sample)
    return made


def test_every_kind_of_segment_has_every_place_equally_often() -> None:
    places = Counter((place, kind) for n in range(6) for place, kind in enumerate(turned(KINDS, n)))
    assert len(places) == len(KINDS) ** 2
    assert set(places.values()) == {2}


def rounds(alone: Sequence[int], read: Sequence[int], again: Sequence[int]) -> list[Round]:
    one = {ALONE: histogram(alone), READ: histogram(read), ALONE_AGAIN: histogram(again)}
    return [one] * 4


def test_equal_segments_have_a_ratio_of_one_and_nothing_in_doubt() -> None:
    samples = range(1000, 2000)
    found = summary(rounds(samples, samples, samples))
    assert (found["low"], found["ratio"], found["high"]) == (1.0, 1.0, 1.0)
    assert found["control"] == {"low": 1.0, "ratio": 1.0, "high": 1.0}
    assert found["shown"]
    assert found["samples"] == dict.fromkeys(KINDS, 4000)


def test_a_reader_that_disturbs_is_seen_and_the_control_does_not_hide_it() -> None:
    quiet, disturbed = range(1000, 2000), range(2000, 4000, 2)
    found = summary(rounds(quiet, disturbed, quiet))
    assert found["ratio"] == pytest.approx(2, rel=0.04)
    assert found["control"]["ratio"] == 1.0
    assert not found["shown"]


def test_one_round_that_was_spoilt_changes_neither_ratio() -> None:
    quiet, stalled = range(1000, 2000), range(10**8, 2 * 10**8, 10**5)
    found = summary([*rounds(quiet, quiet, quiet), *rounds(quiet, stalled, stalled)[:1]])
    assert found["ratio"] == found["control"]["ratio"] == 1.0


def test_the_interval_separates_rounds_that_agree_from_rounds_that_do_not() -> None:
    assert sure([1.5] * 9) == {"low": 1.5, "ratio": 1.5, "high": 1.5}
    found = sure([0.5, 0.7, 0.9, 1.0, 1.1, 1.4, 2.0])
    assert 0.5 <= found["low"] < found["ratio"] == 1.0 < found["high"] <= 2.0


def test_no_lateness_at_all_is_no_division_by_zero() -> None:
    found = summary(rounds([], [0, 0], []))
    assert found["ratio"] == 1.0
    assert found["samples"] == {ALONE: 0, READ: 8, ALONE_AGAIN: 0}


@pytest.mark.slow
def test_the_reader_reads_while_it_is_to_and_ends_with_its_input(tmp_path: Path) -> None:
    path = tmp_path / "robot.stats"
    Executive(Robot(), VirtualClock(), list, Configuration(statistics_path=path)).run(MILLISECOND)
    with reader(path, "process") as other:
        with other.reading():
            pass
        first = other.readings
        with other.reading():
            pass
        assert other.readings > first > 0
        assert other._process.stdin is not None
        other._process.stdin.close()
        assert other._process.wait() == 0


@pytest.mark.slow
def test_the_report_has_a_control_and_the_ratio_last(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ("--rates", "999", "--rounds", "3", "--segment", "0.2", "--save", str(tmp_path))
    assert main(["bench", "reader", *arguments]) == 0
    printed = capsys.readouterr()
    report = json.loads((tmp_path / "reader.json").read_text())
    (found,) = report["rates"]
    assert min(found["samples"].values()) > 0
    assert found["readings"] >= 3
    assert found["low"] <= found["high"]
    assert report["ratio"] == found["ratio"]
    last = printed.out.splitlines()[-1]
    assert last == f"ratio {report['ratio']:.2f} (the farthest from 1)"
    assert printed.err.startswith("bench reader: 999 Hz, 3 rounds")
