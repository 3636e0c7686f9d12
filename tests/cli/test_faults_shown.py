"""A robot whose gyro never rests: every reader says what is wrong, and the run has failed."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

RESTLESS = (
    *("run", "tachobot", "--doubles", "--clock", "virtual", "--for", 4),
    *("--set", "imu.still_rad_s=0.0001"),
)
SENTENCE = "the robot moved"


@pytest.fixture
def kept(command: Callable[..., Any], tmp_path: Path) -> Path:
    path = tmp_path / "tachobot.stats"
    command(*RESTLESS, "--statistics", path)
    return path


@pytest.mark.slow
def test_the_first_line_of_the_end_says_what_is_wrong(command: Callable[..., Any]) -> None:
    ended = command(*RESTLESS)
    assert ended.status == 1
    for first in (ended.error.splitlines()[0], ended.out.splitlines()[1]):
        for part in ("imu", "never ready", "not calibrated", SENTENCE):
            assert part in first
    assert "settled_reason control never began" in ended.out
    assert " faults 7 " in ended.out
    assert re.search(r"fault: imu NotReady 7 times from \S+ s to \S+ s: gyro bias", ended.out)


def test_its_json_has_the_faults_in_the_statistics(command: Callable[..., Any]) -> None:
    ended = command(*RESTLESS, "--json")
    found = json.loads(ended.out)
    assert "never ready" in ended.error
    assert ended.status == 1
    assert found["ended"]["state"] == "failed"
    assert SENTENCE in found["ended"]["reason"]
    assert found["result"]["settled"] is False
    counted = found["statistics"]["faults"]["imu"]["NotReady"]
    assert list(counted) == ["count", "first_s", "last_s", "last"]
    assert counted["count"] == 7
    assert 0.7 < counted["first_s"] < counted["last_s"] < 4
    assert SENTENCE in counted["last"]


def test_every_reader_shows_them(command: Callable[..., Any], kept: Path, tmp_path: Path) -> None:
    shown = command("stats", "--statistics", kept, "--json")
    assert json.loads(shown.out)["faults"]["imu"]["NotReady"]["count"] == 7
    assert SENTENCE in command("stats", "--statistics", kept).out
    metrics = command("stats", "--statistics", kept, "--prometheus").out
    assert (
        'firmware_runtime_faults_total{board="tachobot",kind="NotReady",model="imu"} 7.0' in metrics
    )
    page = tmp_path / "page.html"
    command("report", kept, "-o", page)
    assert SENTENCE in page.read_text()


def test_two_runs_are_compared_in_their_faults(command: Callable[..., Any], kept: Path) -> None:
    compared = json.loads(command("stats", "--diff", kept, kept, "--json").out)["figures"]
    assert compared["faults"] == {"a": 7, "b": 7, "ratio": 1.0}
    assert compared["faults.imu.NotReady"]["a"] == 7


def test_a_run_that_came_to_no_rest_says_why(command: Callable[..., Any]) -> None:
    ended = command("run", "tachobot", "--doubles", "--clock", "virtual", "--for", 1)
    assert ended.status == 0
    assert "settled False\nsettled_reason yaw is off by" in ended.out


def test_a_run_that_was_never_armed_says_so_first(command: Callable[..., Any]) -> None:
    arguments = ("--doubles", "--clock", "virtual", "--for", 1, "--supervised")
    ended = command("run", "tachobot", *arguments, "--arm")
    assert ended.status == 0
    first = ended.out.splitlines()[1]
    assert "never armed" in first
    assert "the guard is absent" in first
    (first, *_) = command("run", "tachobot", *arguments).out.splitlines()[1:]
    assert "never armed" in first
