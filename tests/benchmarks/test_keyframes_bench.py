"""A short run has its keyframes watched, and says whether an activation waited for one."""

import json

import pytest

from benchmarks.keyframes import bench
from firmware_runtime.cli.main import main


@pytest.mark.slow
@pytest.mark.real_time
def test_every_keyframe_is_watched(capsys: pytest.CaptureFixture[str]) -> None:
    words = ("--seconds", "1", "--rate", "100", "--neighbours", "0", "--json")
    status = main(["bench", "keyframes", *words])
    report = json.loads(capsys.readouterr().out)
    assert report["keyframes"] > 0
    assert 0 < report["took_us"] <= report["took_at_most_us"]
    assert (status == 0) == (report["waited"] == 0) == (report["nearest_event_us"] >= 0)
    assert report["activations"] > 50


def test_what_waited_comes_last() -> None:
    keyframes = {"keyframes": 2, "took_us": 300.0, "took_at_most_us": 310.0}
    counted = {"activations": 100, "dropped": 0, "nearest_event_us": -5.0, "waited": 1}
    run = {"rate_hz": 999, "seconds": 1.0, "neighbours": 1}
    lines = list(bench.lines_of({**run, **keyframes, **counted}))
    assert lines[-1] == "activations that waited for a keyframe: 1"
