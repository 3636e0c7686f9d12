"""Experiments over a link: their data are of both ends, and their figures are of their data."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from firmware_runtime.cli.main import main

pytestmark = [pytest.mark.slow, pytest.mark.real_time]

BAD = "delay=20ms,jitter=5ms,loss=2%,seed=1"


@pytest.fixture(autouse=True)
def _state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path / "state"))


def experiment(out: Path, *words: str) -> tuple[dict[str, Any], list[dict[str, str]]]:
    """Figures and data of an experiment that ends well."""
    assert main(["experiment", *words, "-o", str(out)]) == 0
    figures = json.loads((out / f"{words[0]}.json").read_text())
    return figures, list(csv.DictReader((out / f"{words[0]}.csv").read_text().splitlines()))


def test_a_ramp_goes_out_and_back_over_a_good_and_a_bad_network(tmp_path: Path) -> None:
    words = ("loop-delay", "detective", "--for", "4", "--impair", BAD)
    figures, rows = experiment(tmp_path / "out", *words)
    delays = {}
    for stage in ("network", "remote"):
        found = figures["stages"][stage]["delays"]
        of_stage = [row for row in rows if row["stage"] == stage]
        back = [float(row["delay_ms"]) for row in of_stage if row["delay_ms"]]
        assert found["sent"] == len(of_stage)
        assert found["back"] == len(back) > 0
        assert found["most_ms"] == pytest.approx(max(back), abs=1e-6)
        # Not so the other end's instant: a step of its that is late has an earlier one.
        assert all(
            float(row["back_s"]) >= float(row["sent_s"]) for row in of_stage if row["back_s"]
        )
        delays[stage] = found["least_ms"]
    assert 0 < delays["network"] < delays["remote"]
    assert "network-delay" in {
        path.stem.removeprefix("loop-delay-") for path in (tmp_path / "out").iterdir()
    }


def test_a_step_over_a_network_is_compared_with_the_simulation(tmp_path: Path) -> None:
    figures, rows = experiment(tmp_path / "out", "yaw-step", "tachobot", "--stage", "network")
    assert {row["stage"] for row in rows} == {"simulation", "network"}
    found = figures["stages"]["network"]
    assert found["between"] == "udp, between loopback"
    assert found["response"]["samples"] > 0
    assert 0 < found["from_simulation"]["rms"] <= found["from_simulation"]["largest"]


def test_a_ramp_too_short_to_measure_is_said_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["loop-delay", "detective", "--stage", "network", "--for", "1"]
    assert main(["experiment", *words, "-o", str(tmp_path / "out")]) == 2
    assert "expected some, or --for longer" in capsys.readouterr().err
    assert not list(tmp_path.glob("out/*"))
