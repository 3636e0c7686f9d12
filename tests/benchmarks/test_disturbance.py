"""The bench floods, kills, and prints all kinds of spans."""

import json

import pytest

from benchmarks.disturbance.flooder import datagrams
from firmware_runtime.cli.main import main


@pytest.mark.slow
@pytest.mark.real_time
def test_a_flooded_robot_stays_armed(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--seconds", "1", "--rounds", "1", "--rate", "2000", "--json"]
    assert main(["bench", "disturbance", *words]) == 0
    alone, flooded, killed = json.loads(capsys.readouterr().out)["spans"]
    assert [each["kind"] for each in (alone, flooded, killed)] == ["alone", "flooded", "killed"]
    assert alone["sent"] == 0 < flooded["sent"]
    assert alone["armed"] is flooded["armed"] is True
    assert killed["kills"] > 0
    assert min(each["scheduled"] for each in (alone, flooded, killed)) > 0


def test_a_flood_has_datagrams_of_every_kind() -> None:
    sizes = {len(each) for each in datagrams(seed=1)}
    assert min(sizes) < 88
    assert 166 in sizes
    assert max(sizes) > 8192
