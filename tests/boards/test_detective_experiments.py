"""The detective's experiments: the paper's output lines beside ours, and a mission."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from firmware_boards.detective.experiments import figure_6

from firmware_runtime.cli.main import main
from tests.support.figure_6 import EVENTS, OUTPUTS

Command = Callable[..., Any]


def test_it_is_the_published_figure() -> None:
    assert (figure_6.EVENTS, list(figure_6.PUBLISHED)) == (EVENTS, OUTPUTS.splitlines())


@pytest.mark.parametrize(("assignments", "equal"), [([], 11), (["model.hop_s=0.02"], 0)])
def test_every_line_is_compared(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    assignments: list[str],
    equal: int,
) -> None:
    monkeypatch.setenv("FIRMWARE_RUNTIME_STATE_DIRECTORY", str(tmp_path / "state"))
    changed = [word for each in assignments for word in ("--set", each)]
    words = ["experiment", "figure-6", "detective", "-o", str(tmp_path / "out"), *changed]
    assert main(words) == 0
    assert f"{equal} of 11 output lines are those of Figure 6" in capsys.readouterr().out
    figures = json.loads((tmp_path / "out/figure-6.json").read_text())
    assert figures["figure"] == "Figure 6"
    assert figures["ours"] == {"output_lines": 11, "lines_equal": equal}
    assert figures["paper"] == {"output_lines": 11}


@pytest.mark.slow
def test_a_mission_ends_before_the_target_and_is_drawn(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ["experiment", "mission", "detective", "--stage", "simulation", "-o", str(out)]
    assert main(words) == 0
    found = json.loads((out / "mission.json").read_text())["ours"]
    assert found["simulation_found"] == 1
    assert 0.05 < found["simulation_stopped_m"] < 0.5
    assert "Detective robot in its arena" in (out / "mission-arena.svg").read_text()
    assert "data:image/svg+xml" in (out / "mission.html").read_text()
