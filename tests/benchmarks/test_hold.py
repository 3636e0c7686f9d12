import json
import sys

import pytest

from benchmarks.hold import ours as hold_ours
from benchmarks.hold.measure import KINDS, periods, transitions


@pytest.mark.parametrize("kind", KINDS)
def test_our_engine_does_the_work_that_the_plan_says(
    kind: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["hold_ours", kind, "7"])
    hold_ours.main()
    answer = json.loads(capsys.readouterr().out)
    assert answer["counts"] == {"internal": transitions(kind, 7)}
    assert transitions(kind, 7) == pytest.approx(20_000, rel=0.01)


def test_distinct_periods_are_distinct() -> None:
    assert len(set(periods("distinct", 200))) == 200
    assert len(set(periods("equal", 200))) == 1
