"""The flood's bench floods, and prints both kinds of spans."""

import json

import pytest

from benchmarks.flood.flooder import datagrams
from firmware_runtime.cli.main import main


@pytest.mark.slow
@pytest.mark.real_time
def test_a_flooded_robot_stays_armed(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--seconds", "1", "--rounds", "1", "--rate", "2000", "--json"]
    assert main(["bench", "flood", *words]) == 0
    alone, flooded = json.loads(capsys.readouterr().out)["spans"]
    assert (alone["kind"], flooded["kind"]) == ("alone", "flooded")
    assert alone["sent"] == 0 < flooded["sent"]
    assert alone["armed"] is flooded["armed"] is True
    assert flooded["scheduled"] > 0


def test_a_flood_has_datagrams_of_every_kind() -> None:
    sizes = {len(each) for each in datagrams(seed=1)}
    assert min(sizes) < 88
    assert 166 in sizes
    assert max(sizes) > 8192
