"""Doubles of a run broken from a page, and the test that is made of it."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest

from firmware_runtime.errors import ConfigError
from firmware_runtime.hal.wire_errors import BusAbsent
from firmware_runtime.live import breaking
from firmware_runtime.live.breaking import WORLD, breaks, clear, strike
from firmware_runtime.live.run_process import kill
from firmware_runtime.statistics.reader import read_statistics
from tests.support.command import started
from tests.support.foxglove_viewer import viewed, viewer_of
from tests.support.served_page import served_page
from tests.support.waiting import PATIENCE_S, wait_until

KP = "controller.yaw.kp"
BEGAN = 1_700_000_000_000_000_000
"""A date before any run, ns."""
pytestmark = [pytest.mark.slow, pytest.mark.real_time]


@pytest.fixture
def socket(tmp_path: Path) -> Iterator[Path]:
    """TachoBot's doubles, served."""
    path = tmp_path / "doubles.sock"
    server = started("doubles", "serve", "tachobot", "--socket", path)
    try:
        assert server.stdout is not None
        assert server.stdout.readline().startswith("serving ")
        yield path
    finally:
        server.terminate()
        server.communicate(timeout=PATIENCE_S)


@pytest.fixture
def run(socket: Path, tmp_path: Path) -> Iterator[Path]:
    """A run on them, with its statistics there."""
    statistics = tmp_path / "x.statistics"
    words = ("run", "tachobot", "--doubles", socket, "--for", PATIENCE_S)
    process = started(*words, "--statistics", statistics, stderr=subprocess.PIPE)
    try:
        wait_until(lambda: _is_under_way(statistics), "the run begins")
        yield statistics
    finally:
        process.kill()
        process.communicate(timeout=PATIENCE_S)


def _is_under_way(statistics: Path) -> bool:
    return statistics.exists() and read_statistics(statistics).figures().run > 0


def test_what_can_be_broken_has_words_and_devices(socket: Path) -> None:
    offered = breaks(socket)
    assert offered["board"] == "tachobot"
    assert "freeze" in offered["kinds"]
    assert all(offered["kinds"].values())
    devices = {each["name"]: each for each in offered["devices"]}
    assert devices["imu"]["what"] == "MPU-9250 at 0x68"
    assert "freeze" in devices["imu"]["kinds"]
    assert devices[WORLD]["kinds"] == ["push", "hold"]
    assert offered["amounts"]["push"]["unit"]
    assert offered["struck"] == []
    json.dumps(offered, allow_nan=False)


def test_faults_are_listed_by_the_time_of_the_run_and_end_when_cleared(
    socket: Path, run: Path
) -> None:
    assert read_statistics(run).header.conditions["doubles"] == str(socket)
    strike(socket, "freeze", "imu", 0.5)
    strike(socket, "brown-out", "thrust_pairs", 1.0)  # a moment, which lasts no time
    struck = strike(socket, "push", WORLD, None, 0.2)["struck"]
    assert [(each["kind"], each["device"], each["for_s"]) for each in struck] == [
        ("freeze", "imu", 0.5),
        ("brown-out", "thrust_pairs", 0.0),
        ("push", WORLD, 0.0),
    ]
    assert 0.0 < struck[0]["at_s"] <= struck[2]["at_s"] < PATIENCE_S
    assert struck[2]["amount"] == 0.2
    strike(socket, "nack", "imu")
    assert breaks(socket)["struck"][-1]["for_s"] is None
    assert clear(socket)["struck"][-1]["for_s"] is not None


def test_what_was_broken_becomes_a_test_that_passes(socket: Path, run: Path) -> None:
    assert run.exists()
    strike(socket, "nack", "imu", 0.3)
    test = run.parent / "test_found.py"
    test.write_text(breaking.test_text(socket))
    assert "def test_found" in test.read_text()
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(test)]
    done = subprocess.run(words, cwd=run.parent, capture_output=True, text=True, check=False)
    assert "1 passed" in done.stdout, done.stdout + done.stderr


def test_a_page_breaks_clears_stalls_and_kills(run: Path) -> None:
    with served_page("--statistics", run) as page:
        kinds = page.said("/api/breaks")["devices"][0]["kinds"]
        assert "freeze" in kinds
        said = {"kind": "freeze", "device": "imu", "for_s": 0.2}
        answer = page.ask("/api/break", json.dumps(said).encode())
        assert [each["kind"] for each in answer.document["struck"]] == ["freeze"]
        assert page.ask("/api/clear", b"{}").status == 200
        assert page.ask("/api/break", b'{"kind": "melt"}').status == 409
        assert b"def test_found" in page.ask("/api/break-test").content
        assert page.ask("/api/stall", b'{"for_s": 0.05}').status == 200
        assert page.ask("/api/stall", b'{"for_s": 5}').status == 409
        assert page.ask("/api/kill", b"{}").status == 200
        wait_until(lambda: page.said("/api/state")["state"] == "died", "the page says so")


def test_values_of_the_run_go_to_other_viewers(run: Path) -> None:
    words = ("view", "--statistics", run, "--port", 0, "--no-browser", "--foxglove", 0)
    process = started(*words)
    try:
        assert process.stdout is not None
        address = process.stdout.readline().split()[-1]
        at, value = viewed(_first_sample(address))
    finally:
        process.terminate()
        process.communicate(timeout=PATIENCE_S)
    assert {"acceleration", "rate"} <= value.keys()
    assert at > BEGAN


async def _first_sample(address: str) -> tuple[int, Any]:
    async with viewer_of(address) as viewer:
        await viewer.subscribe("/tachobot/ports/imu/sample")
        return await viewer.value()


def test_a_run_under_way_is_gone_back_in_tried_and_saved(run: Path) -> None:
    with served_page("--statistics", run) as page:
        wait_until(lambda: page.said("/api/state")["at_s"] > 1.0, "a second has passed")
        found = page.said("/api/instant?at=1000000000&snapshot=1")
        assert found["at"] <= 1_000_000_000 < found["next"]
        assert found["lateness_us"] > 0.0
        assert found["note"] is None
        while not found["transfers"]:  # a step that read nothing
            found = page.said(f"/api/instant?at={found['previous']}")
        assert found["transfers"][0]["device"] == "imu (MPU-9250)"
        assert page.said(f"/api/instant?at={found['previous']}")["next"] == found["at"]
        values = {each["key"]: each["value"] for each in page.said("/api/sliders")}
        tried = page.ask("/api/try", json.dumps({"values": {KP: 2 * values[KP]}}).encode())
        assert f"{KP}=1.5 (in the run 0.75)" in tried.document[0]["text"]
        copy = page.ask(f"/api/board-file?values={quote(json.dumps({KP: 1.5}))}")
        assert b"\nkp = 1.5\n" in copy.content
        table = page.ask("/api/export?ports=imu.sample&begin_s=0&end_s=99&ending=csv")
        assert table.content.startswith(b"t_ns,t_s,utc,acceleration.0,")


def test_a_killed_run_has_died(run: Path) -> None:
    kill(run)
    wait_until(lambda: not read_statistics(run).writer_alive, "the run is dead")


def test_without_faults_there_is_no_test(socket: Path) -> None:
    with pytest.raises(ConfigError, match="no robot was run"):
        breaking.test_text(socket)


@pytest.mark.parametrize(
    ("said", "why"),
    [
        (("melt", "imu"), "melt"),
        (("freeze", "imuu"), "imu"),
        (("silent", "imu"), "silent"),
        (("freeze", "imu", -1.0), "expected 0 or more"),
        (("freeze", "imu", "long"), "a number"),
        (("freeze", "imu", 1e9), "3600 at most"),
        (("push", WORLD, None, float("nan")), "a number"),
        ((None,), "no kind"),
        (("freeze", 3), "no kind"),
    ],
)
def test_what_cannot_be_made_is_refused(socket: Path, said: tuple[object, ...], why: str) -> None:
    with pytest.raises(ConfigError, match=why):
        strike(socket, *said)
    assert breaks(socket)["struck"] == []


def test_where_nothing_is_served_nothing_can_be_broken(tmp_path: Path) -> None:
    with pytest.raises(BusAbsent):
        breaks(tmp_path / "nothing.sock")
